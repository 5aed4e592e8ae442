"""Command line: parse the arguments of a command, call a public function, show its result."""
