"""Suite of asv, see asv.conf.json."""
