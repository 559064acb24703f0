"""The same scenes in other engines, each judged by the same closed forms."""
