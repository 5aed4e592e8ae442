"""The paper's cases, figures and statements, computed anew and answered with measured numbers.

The paper is Li, Wang, Gantes and Tan 2020, doi:10.1177/1369433220971728. Its two tables of parameters are lost; what they
leave open is a `Choice`, with documented defaults, and is varied to see which answers depend on it.
"""
