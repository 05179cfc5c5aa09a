"""How engines read a model: the body of a file, the body that an engine has after loading it, and the mistake between them."""
