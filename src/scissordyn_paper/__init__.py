"""Reproduction of the paper: its cases, figures and statements, with measured numbers.

The paper is Li, Wang, Gantes and Tan 2020, doi:10.1177/1369433220971728. Its two tables of parameters are lost; the
parameters in them are a `Choice` with documented defaults, which is varied to see which answers depend on it.
"""
