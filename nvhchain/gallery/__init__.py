"""Gallery of S. Shweiki's thesis: its figures and tables of chapters 3 to 5 by the chain, beside its stated numbers.

`python -m nvhchain.gallery [NUMBER ...] [--out DIR]` makes them.
"""
