# Imported first where the heap is small. Without it garbage is collected only when the heap has run out: by then
# what lives on stands between what died, and no room is left in one piece.

import gc

gc.threshold(256)
