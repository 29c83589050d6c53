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
    phase = zero
    quiet = zero
    since = zero
tick:
    after = minus_one
    since = $length + since min most_since
    quiet = $length + quiet min most
    if empty goto silent
    quiet = $last
    if several goto many
    tau = $times
    $places keep
    raw = zero s+ half
    c = raw - o@last
    goto known
many:                                   # about the mean time, by logarithms; what is left goes into e
    $number log
    off = o@m1 + o@m2 + o@m3
    log_n = ~
    $times log
    ~ - log_n exp
    tau = ~
    $number by
    times tau time
    left = $times - ~
    off over 6
    places = $places - ~
    places keep log
    ~ + log_64 - log_n exp
    raw = zero s+ ~
    c = raw
known:
    turn = turn + one chance
    phase - two
    if neg goto young
    dt = since - tau max clock log
    moved = $moved
    room = $counts + half
    log_dt = ~
    dt by
    times a half_velocity
    w = raw - edge keep
    near = zero s+ w - sixteenth
    t = v + ~
    V = t + ~
    times t place
    w = log_dt - log_T lo+ log_T + log_growth
    near
    if neg goto same
event:
    P = p + ~
    w exp                               # memory grows by g·min(dt, T)
    edge = raw - moved
    e = c - P
    log_dt - log_T + log_4096
    if neg goto full
grow:
    growth keep
    memory = T s+ ~ min most_memory
grown:
    since = tau
    if several goto mean
located:
    e keep log
    zero s+ e - room
    if pos goto slip
    log_e = ~
    e - mu over 2
    slips = zero
    zero s+ e - D4
    if pos goto alone
    mu = mu + ~ keep
    Ds - D4 s+ mu s+ mu
    if pos goto four
    memory log
sized:
    T = memory
    log_T = ~
    log_X = log_dt - log_T min log_quarter gain 1
    e keep
    of_v = log_e - log_dt + log_X + log_X
    sum + ~ exp
    of_a = of_v + log_X - log_dt
    v = V s+ ~
    log_X gain 2
    change = e - before
    before = e
    of_a + ~ exp
    a = a s+ ~
    log_X gain 0
    log_e + log_X + ~ exp
    p = P - moved s+ ~
    a keep log
    phase = two
    after = one
    log_X + log_64                      # order one, where the acceleration is not seen
    if pos goto curved
    log_aT = ~ + log_T
    of_limit = log_aT + log_T
    sum + of_limit - log_X - limit
    if neg goto straight
    sum - log_9_4
    if pos goto curved
    log_X + log_256
    if pos goto curved
straight:
    quality = of_straight
    log_aT - of_slope exp
    as = zero
    vs = v s- ~
    goto show
curved:
    quality = of_curve
    vs = v
    as = a
show:                                   # the velocity at the time when it is shown
    since + lead by
    times as velocity
    velocity = vs + ~
place:                                  # and the place at the end of the tick
    since by
    times as half_velocity
    t = vs + ~
    times t place
    z = p + ~
shown:
    tick by
    times velocity shown
    z out position_fine
    ~ min most_shown max least_shown out velocity
    trouble + log_4 max zero + limit - order + log_X over 1  # D·√X, more if errors keep a sign
    ~ + quality - log_T exp
    ~ min most_quality out quality
    slope by
    times as acceleration
    ~ out acceleration
    after
    if neg goto end
    sum - one
    if neg goto ready
learn:                                  # nothing below is in a hurry
    change keep
    log_X + log_256
    if pos goto short
    e keep over 1
    change = e + ~
short:
    change keep
    noises = noises + noises_one min noises_most max noises_first
    sum min noises_offset by
    w = D + D + D
    zero s+ change - D min w over by
    D = D + ~ max least_noise
    v keep
    t = zero s+ v min most
    v = zero s+ t
    a keep
    t = zero s+ a min most
    a = zero s+ t
    t = e - lag keep log
    ~ + log_X + log_3_2 exp
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
    D log
    growth = zero
    log_growth = zero
    limit = ~ + ~ + order
    D over 1
    t = log_X + limit - order_lag
    Ds = D
    log_X + log_256
    if pos goto scaled
    Ds = D + ~
    t = t + log_9_4
scaled:
    lag log
    D4 = Ds + Ds + Ds + Ds
    trouble = ~ + ~ - t                 # lag² over 7/2 U
    if pos goto lost
    T - slow_T
    if pos goto end
    log_growth = log_eighth
end:
    end
lost:
    growth = minus_one
    log_growth = log_half
    trouble - log_4
    if neg goto end
    slow_T = T + T
    goto end
full:                                   # 4096·dt < T: memory does not grow
    growth
    if neg goto grow
    memory = T
    goto grown
alone:
    mu = mu + ~
    log_dt + log_8 exp
    goto fired
four:
    log_dt + log_32 exp
fired:
    slow_T = zero
    memory = memory - ~ lo+ ~ log
    goto sized
mean:
    $number by
    times P mean
    t = places - ~
    left keep
    zero s+ left by
    times V place_64
    t s+ ~ keep log
    ~ + log_64 - log_n exp
    e = zero s+ ~
    goto located
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
    moved = $moved
    p = c - moved
    edge = raw - moved
    since = tau
    phase = one
    v = zero
    vs = zero
    a = zero
    as = zero
    slips = zero
    velocity = zero
    quality = none
    goto place
young:
    phase - one
    if neg goto first
    dt = since - tau max clock log
    moved = $moved
    log_dt = ~
begin:
    e = c - p keep log
    slips = zero
    ~ + of_velocity - log_dt exp
    phase = two
    edge = raw - moved
    since = tau
    p = c - moved
    v = zero s+ ~
    vs = v
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
    quiet = quiet max zero
    sum - forget
    if pos goto rest
    phase - two
    if neg goto nothing
    since + lead by
    times as velocity
    velocity = vs + ~
    since by
    times as half_velocity
    t = vs + ~
    times t place
    z = p + ~ keep
    if neg goto below
    z + o@up
    goto beyond
below:
    zero - z - o@down
beyond:
    max zero
    beyond = sum - half - D4 - Ds
    if neg goto still
    z = z s- beyond
    quiet + lead log
    share = zero
    beyond - half
    if neg goto whole
    share = log_5_8
whole:
    of_speed - ~ - share exp
    t = ~
    t = zero s+ velocity min t
    velocity = zero s+ t
still:
    quiet - max_time
    if neg goto shown
    velocity = zero
    goto quiet
rest:
    phase = zero
    since = zero
    quiet = zero
    p = zero
nothing:
    quality = none
    velocity = zero
    z = p
quiet:
    as = zero
    goto shown
"""
