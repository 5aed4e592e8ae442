"""Many runs: parameters, runners, and what is built from them."""
