"""Which samples: edge functions in exact integers, the rule for samples on an edge, the algorithms and their only writers."""
