"""The format of scenario files: what they may say, and the scene that is built from them."""
