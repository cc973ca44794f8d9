"""One file per scene, found by its name: the planes on which its methods should break (see
`survey.failures`).
"""
