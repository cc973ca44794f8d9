"""The methods: one integrator or quadrature per file; its docstring names order, domain and source.

A method module holds ORDER (int; 0: a closed form), SERVES (families it serves: "hill" for linear Hill equations,
"cylinder" for flows on the cylinder), and for each family the functions that the family's measure names.
"""
