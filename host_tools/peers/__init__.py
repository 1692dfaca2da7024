"""Other methods on the same sensor stream, for the columns beside the product's own."""
