"""Whether recorded motions, programs, engines and loaded bodies are right, and the mistakes that explain what is wrong."""
