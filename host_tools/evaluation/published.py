"""What the paper says in its section 5, for the columns beside ours."""

MEAN_CM = 5.0           # Fig. 6, and the deviation of Fig. 5(b)
WITHIN_CM = 8.0         # Fig. 5(a): all 20 stops
VECTORS, SECTIONS = 458, 6   # Fig. 7(b)
MEMORY_KB = {"grid": 418.0, "vector": 202.0, "topological-vector": 28.2}       # Table 2
ROBOT_S = {"grid": 7033.6, "vector": 3503.4, "topological-vector": 3029.5}
HOME = "SDR site B, University of Southern California"
