"""Machines that nobody developed on, and a concealed cause, both drawn from a seed."""
