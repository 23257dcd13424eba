"""The figures and claims of Yin et al. 2018, run again: measures, criteria, tables, pictures."""
