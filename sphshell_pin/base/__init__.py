"""What all folders use and no user calls: checks, parameters, files, text."""
