"""Functions that know no family: arithmetic, series, elliptic integrals, tableaux."""
