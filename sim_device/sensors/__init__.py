# One sensor a file. Each owns its seeded noise and its documented error model.
