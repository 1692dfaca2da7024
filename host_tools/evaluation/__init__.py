"""The paper's section 5 again: missions in parallel, kept from one evaluation to the next, and what is drawn from them."""
