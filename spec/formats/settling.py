"""How a place that waits for a count goes to the middle of its count as the velocity falls, as a part of the program.

A place that is 3/8 count away begins to wait when the velocity has fallen to half of that at the last count. Half a
count is its limit then; the limit halves each time the velocity halves again. Velocities are compared by logarithms;
some LSB are as good as none.
"""

SETTLING = """
settles {; settle:
    speed log
    mark - ~; if neg goto steady
    mark = mark + log_half max log_9_4
    reach over 1
    reach = ~
steady:
    P keep
    bar s+ P; if neg goto told
    reach - half; if pos goto told
    bar = zero
    s+ P - reach; if neg goto told
    zero s+ reach out position_fine
    goto told; }
"""

# Its words are where others are that only a count needs.
SHARED = {"speed": "V", "mark": "c", "reach": "raw", "bar": "moved"}
