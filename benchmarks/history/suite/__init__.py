"""Suite of asv; its settings are in asv.conf.json."""
