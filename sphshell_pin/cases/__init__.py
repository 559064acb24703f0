"""Cases with a known truth: error, bound and verdict, and their pictures, tables and sections."""
