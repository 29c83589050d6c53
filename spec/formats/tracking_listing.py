"""The program of the tracking method as a listing; docs/concepts/track.md says what it computes.

One line is one chain of the adder, from left to right: `word = first term, further terms, what is begun with the sum`.

    + w, - w      add, subtract               s+ w, s- w    with the sign that `keep` kept
    lo+ w, hi+ w  min(sum, 0) + w, max(sum, 0) + w          min w, max w  the lesser, the greater
    sum           as first term: go on from the line before
    ~             the result of the unit, read before it begins anew      $x     an input of the tick, as first term
    o@last, o@up, o@down   the offset of the last count's edge, of the edge above and below the position
    o@m1, o@m2, o@m3       of the last count if n mod 4 ≥ 1, of that before if ≥ 2, of the third if = 3, else 0
    keep          the sign of the sum         log, exp      begin log2|sum|, 2^sum
    gain k        begin: logarithm of the gain of p (0), v (1) or a (2)
    by            the second factor of products              times w name  begin w·factor/2^shift of that name
    product name  begin: the sum times the factor, as `times` does with a word
    over n        begin: shift right by n     over by       by ⌊log2⌋ of the factor's whole part
    chance        the number that decides how results are rounded
    out name      an output
"""

LISTING = """
reset:                                  # before the first tick
    D = quarter
    noises = noises_first
    turn = zero
    o0 = zero
    o1 = zero
    o2 = zero
    o3 = zero
    p = zero
    phase = minus_two
    quiet = zero
    since = zero
    doubt = log_4 - order
    after = minus_one
tick:
    if empty goto silent
    if several goto many
    $places keep
    tau = $times
    raw = zero s+ half
    c = sum - o@last
    quiet = $last
    since = $length + since min most_since
    dt = sum - tau max clock log
    turn = turn + one chance
    moved = $moved
    room = $counts + almost_half
    goto known
many:                                   # about the mean time, by logarithms; what is left goes into e
    $number log
    t = o@m1 + o@m2 + o@m3
    log_n = ~
    $times log
    quiet = $last
    zero - log_n + ~ exp
    since = $length + since min most_since
    tau = ~
    $number by
    turn = turn + one
    times tau time
    dt = since - tau max clock
    left = $times - ~
    t over 6
    places = $places - ~ keep log
    log_64 - log_n + ~ exp
    moved = $moved
    room = $counts + almost_half
    raw = zero s+ ~
    dt log
    turn chance
    c = raw
known:
    log_dt = ~
    dt by
    phase
    if neg goto young
    times a half_velocity
    near = raw - edge keep
    t = v + ~
    V = sum + ~
    times t place
    share = log_dt - log_T
    w = sum lo+ growing
    P = p + ~
    zero s+ near - sixteenth
    if neg goto same
event:
    w exp                               # memory grows by g·min(dt, T), if it grows or 4096·dt ≥ T
    growth keep
    share + least_log
    if neg goto full
    step = zero s+ ~
grown:
    if several goto mean
    e = c - P keep log
    edge = raw - moved
    since = tau
    memory = T + step min most_memory
    goto heard
mean:
    $number by
    times P mean
    left keep
    edge = raw - moved
    t = places - ~
    zero s+ left by
    since = tau
    times V place_64
    memory = T + step min most_memory
    t s+ ~ keep log
    log_64 - log_n + ~ exp
    e = zero s+ ~ keep log
heard:
    room s- e
    if neg goto slip
    log_e = ~
    e - mu over 2
    slips = zero
    zero s+ e - D4
    if pos goto alone
    mu = mu + ~ keep
    since + lead by
    zero - D3 s+ mu s+ mu
    if pos goto four
    T = memory log
    of_e = log_e - log_dt
    goto sized
alone:
    mu = mu + ~
    since + lead by
    log_dt + log_8 exp
    of_e = log_e - log_dt
    goto fired
four:
    log_dt + log_32 exp
    of_e = log_e - log_dt
fired:
    slow_T = zero
    T = memory - ~ lo+ ~ log
sized:
    e keep
    log_T = ~
    log_X = log_dt - log_T min log_quarter gain 1
    of_v = of_e + log_X + log_X
    sum + ~ exp
    of_a = of_v + log_X - log_dt
    v = V s+ ~
    log_X gain 2
    of_a + ~ exp
    of_a = log_T - of_slope
    after = one
    a = a s+ ~ keep log
    log_X + log_64                      # order one, where the acceleration is not seen
    if pos goto curved
    log_T + log_T + log_T + log_T - log_X - limit + ~ + ~
    if neg goto straight
    sum - log_9_4
    if pos goto curved
    log_X + log_256
    if neg goto straight
curved:
    times a velocity                    # the velocity at the time when it is shown
    as = sum
    quality = of_curve
    vs = v
    velocity = sum + ~
    goto placed
straight:
    of_a + ~ exp
    as = zero
    quality = of_straight
    vs = v s- ~
    velocity = sum
placed:
    e keep
    log_X gain 0
    log_e + log_X + ~ exp
    noises = noises + noises_one
    p = P - moved s+ ~
place:                                  # and the place at the end of the tick
    since by
    v keep
    times as half_velocity
    t = zero s+ v min most
    vs + ~ product place
    v = zero s+ t
    least = one
    if empty goto seen
    p + ~ out position_fine
shown:
    tick by
    w = doubt + log_X                   # D·√X, more if errors keep a sign
    times velocity shown
    noises = noises min noises_most
    t = ~
    w over 1
    quality - log_T + ~ exp
    t min most_shown max least_shown out velocity
    t = ~
    slope by
    times as acceleration
    t max least min most_quality out quality
    ~ out acceleration
    after
    if neg goto end
    sum - one
    if neg goto ready
learn:                                  # nothing below is in a hurry
    t = e - before keep
    before = e
    log_X + log_256
    if pos goto short
    trouble
    if pos goto short
    e over 1
    t = e + ~ keep
short:
    noises = noises max noises_first    # an upset may have made it less
    sum min noises_offset by
    w = D + D + D
    zero s+ t - D min w over by
    a keep
    t = zero s+ a min most
    D = D + ~ min most_noise max least_noise
    a = zero s+ t
    e - lag keep log
    log_X + log_3_2 + ~ exp
    lag = lag s+ ~
    if several goto ready
    log_X + past_4
    if pos goto ready
    noises max noises_least by
    e keep
    zero s+ e min half over by          # a quarter of what the kind's offset learns
    o@last = o@last s+ ~ s+ ~ s+ ~ s+ ~
    o0 = o0 s- ~
    o1 = o1 s- ~
    o2 = o2 s- ~
    o3 = o3 s- ~
ready:                                  # growth of the memory and noise, for the next event
    after = minus_one
    D log
    Ds = D
    growth = zero
    growing = log_T
    least_log = log_4096
    limit = ~ + ~ + order
    lag log
    w = log_X + limit - order_lag
    trouble = ~ + ~ - w                 # lag² over 7/2 U
    log_X + log_256
    if pos goto scaled
    D over 1
    trouble = trouble - log_9_4
    Ds = D + ~
scaled:
    doubt = trouble + log_4 max zero + limit - order
    D3 = Ds + Ds + Ds
    D4 = sum + Ds
    trouble
    if pos goto lost
    T - slow_T
    if pos goto end
    growing = log_T + log_eighth
end:
    end
lost:
    growth = minus_one
    least_log = count
    growing = log_T + log_half
    trouble - log_4
    if neg goto end
    slow_T = T + T
    end
full:
    step = zero
    goto grown
slip:                                   # counts were lost or added, or the offset was upset
    o@last = o@last min quarter max minus_quarter
    slips = slips + one
    sum - three
    if pos goto begin
    log_dt + log_4 - log_T - one
    if pos goto begin
    p = c - moved
    goto show
first:
    p = c - moved
    edge = raw - moved
    since = tau
    phase = minus_one
    goto nothing
young:
    phase + one
    if neg goto first
begin:
    e = c - p keep log
    slips = zero
    edge = raw - moved
    of_velocity - log_dt + ~ exp
    phase = zero
    since = tau
    p = c - moved
    v = zero s+ ~
    vs = sum
    a = zero
    as = zero
    mu = zero
    lag = zero
    before = zero
    slow_T = zero
    T = dt
    log_T = log_dt
    log_X = log_quarter
    after = zero
    quality = of_curve
    goto show
same:                                   # the same edge again: no event, unless it moved
    ~ keep
    zero s+ ~ - quarter
    if pos goto event
    edge = edge - moved
    p = p - moved
    goto show
silent:
    since = $length + since min most_since
    quiet = $length + quiet max zero min most
    sum - forget
    if pos goto rest
    phase
    if neg goto nothing
show:
    since + lead by
    times as velocity
    velocity = vs + ~
    goto place
seen:
    P = p + ~ keep
    if neg goto below
    sum + o@up
    goto beyond
below:
    zero - P - o@down
beyond:
    max zero
    t = sum - half - D4 - Ds
    if neg goto still
    P = P s- t
    quiet + lead log
    w = zero
    t - half
    if neg goto whole
    w = log_5_8
whole:
    w = of_speed - w - ~ exp
    t = zero s+ velocity - ~ lo+ ~
    velocity = zero s+ t
    w + of_bound exp                    # the error is at most the bound
    least = ~
still:
    P out position_fine
    quiet - max_time
    if neg goto shown
    velocity = zero
    goto quiet
rest:
    phase = minus_two
    since = zero
    quiet = zero
    p = zero
nothing:
    quality = none
    least = zero
    velocity = zero
    p out position_fine
quiet:
    as = zero
    goto shown
"""
