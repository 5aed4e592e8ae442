"""Cases to rows: blocks, the store, optimisation, surrogates."""
