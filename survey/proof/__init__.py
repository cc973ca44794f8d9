"""Proofs of stability maps: what to state (`search`, `formulas`), and the program that proves it
(`checker`).
"""
