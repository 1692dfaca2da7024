# What joins the virtual robot to the core and to viewers: ptys, and files that keep what passed.
