"""Measurements of nvhchain, one script per table or page; `python -m benchmarks LIST` lists them."""
