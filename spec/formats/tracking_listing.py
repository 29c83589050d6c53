"""The program of the tracking method as a listing; docs/concepts/track.md says what it computes.

One line, or part of it up to a `;`, is one chain of the adder, from left to right: `word = first term, further terms,
what is begun with the sum`.

    + w, - w      add, subtract               s+ w, s- w    with the sign that `keep` kept
    lo+ w, hi+ w  min(sum, 0) + w, max(sum, 0) + w          min w, max w  the lesser, the greater
    sum           as first term: go on from the line before      chance        decides how results are rounded
    ~             the result of the unit, read before it begins anew      $x     an input of the tick, as first term
    o@last, o@up, o@down   the offset of the last count's edge, of the edge above and below the position
    o@m1, o@m2, o@m3       of the last count if n mod 4 ≥ 1, of that before if ≥ 2, of the third if = 3, else 0
    keep          the sign of the sum         log, exp      begin log2|sum|, 2^sum       out name      an output
    gain k        begin: log of the gain of p (0), v (1), a (2)  block, serial  before a line: for that machine only
    smooth, edges, reads   before a line, or several in braces: with --smooth, of counted edges, of read positions
    period, kinds, waits   the same: of reads with --period, of edges or reads with offsets, of reads without a check
    map, plain, settles    before a line: for a core with a map of the disc, without one, with `SETTLING`
    by            the factor of products      product name  begin: sum·factor/2^shift of that name
    over n        begin: shift right by n     over by       by ⌊log2⌋ of the factor's whole part
"""

LISTING = """
reset:                                  # before the first tick
    edges D = quarter log; reads D = least_noise log
    noises = noises_first; turn = zero; kinds o0 = zero; kinds o1 = zero
    kinds o2 = zero; kinds o3 = zero; p = zero; phase = minus_two
    period {; o4 = zero; o5 = zero; o6 = zero; o7 = zero; }
    limit = order + ~ + ~; doubt = log_8; edges quiet = zero; after = minus_one
tick:
    if empty goto silent
    reads {; tau = $times               # the place is that of the end of the tick
    turn = turn + one chance; moved = $moved; c = sum
    period $places by; period o@up - o@last product mean; period c = moved - o@last - ~
    since = $length + since min most_since; dt = sum - tau max clock log; block dt by
    block log_dt = ~; phase; }
    edges {; $number log; if one goto single
    t = o@m1 + o@m2 + o@m3              # about the mean time, by logarithms; what is left goes into e
    minus_log_n = zero - ~; $times log; since = $length + since min most_since
    minus_log_n + ~ exp; block minus_log_n = log_64 + minus_log_n
    serial quiet = $last; serial turn = turn + one; block $number by; serial tau = ~
    serial $number by; serial moved = $moved; block tau = ~ product time
    serial tau product time; dt = since - clock - tau hi+ clock; left = $times - ~; t over 6
    block dt by; places = $places - ~ keep log
    serial log_64 + minus_log_n + ~ exp; block minus_log_n + ~ exp
    raw = zero s+ ~; block c = sum; dt log
    serial turn chance; block turn = turn + one chance; serial c = raw
    block log_dt = ~; phase; }
known:
    if neg goto young
    block {; step = zero                # what the velocity waits for comes first
    edges e = raw - edge keep; edges w = minus_sixteenth s+ e; share = log_dt - log_T
    a product half_velocity; V = v + ~ + ~; v + ~ product place
    edges $number by; edges u = $counts + slack - one
    edges ~ keep                        # the same edge again: no event, unless it moved
    edges x = minus_quarter s+ ~; edges P = p + ~ product mean; reads P = p + ~
    edges x max w; edges if neg goto same; edges t = places - ~; share lo+ growing exp
    growth keep; share + log_8192 - growth; if neg goto grown; step = zero s+ ~
grown:; }
    serial {; log_dt = ~; dt by; a product half_velocity; edges e = raw - edge keep
    share = log_dt - log_T; w = sum lo+ growing; t = v + ~; V = sum + ~; step = zero
    t product place; edges minus_sixteenth s+ e; edges if pos goto event
    edges ~ keep                        # the same edge again: no event, unless it moved
    edges minus_quarter s+ ~; edges if neg goto same
event:
    P = p + ~
    w exp                               # memory grows by g·min(dt, T), if it grows or 8192·dt ≥ T
    growth keep; share + log_8192 - growth; if neg goto grown; step = zero s+ ~
grown:; }
    edges {; serial $number by; if one goto lone; left keep; serial P product mean
    block zero s+ left by; memory = T + step min most_memory max clock
    serial t = places - ~; block log_dt + log_many exp; block x = memory - ~ lo+ ~
    serial zero s+ left by; V product place_64; smooth since + of_e out smooth_delay
    serial since = tau; serial P = P - moved; t s+ ~ keep log
    serial log_64 + minus_log_n + ~ exp; block minus_log_n + ~ exp
    serial edge = raw - moved; smooth of_v out velocity_smooth
    block u - ~; block if neg goto slip; e = zero s+ ~ keep log; }
    reads goto lone
heard:; block tau + ahead by
    serial edges $counts + slack - one s- e; serial edges if neg goto slip; log_e = ~
    e - mu over 2; minus_D4 s+ e; if pos goto alone; mu = mu + ~ keep
    serial since + ahead by; minus_D3 s+ mu s+ mu; if neg goto calm
    serial log_dt + log_many exp; serial T = memory - ~ lo+ ~; slow_T = zero; block e over 1
    log_X + log_256; if pos goto kept
    serial e over 1                     # the memory was long: half of the error is of the place
    log_e = log_e + log_half; mu = mu s+ minus_Ds; P = P + ~; e = e - ~
kept:; serial T log; block T = x log
sized:
    of_e = log_e - log_dt; e keep; after = one; log_T = ~
    serial log_X = log_dt - ~ min log_quarter gain 1; block log_X = log_dt - ~ min log_quarter gain 2
    serial of_v = sum + of_e + log_X; block share = log_T - of_slope; block of_v = log_X + of_e + log_X
    block sum + log_X - log_dt + ~ exp; serial sum + ~ exp; w = log_X + limit
    log_X + log_256; if pos goto few; w = w + log_9_4
few:
    serial v = V s+ ~; serial log_X gain 2; serial of_v + log_X - log_dt + ~ exp
    t = log_T + log_T; serial step = D + D; serial of_e = log_e + log_X; t = t + t - w
    serial a = a s+ ~ keep log
    block {; a = a s+ ~ log
    w = log_X + log_64                  # order one, where the acceleration is not seen
    t = t + ~ + ~; share = share + ~; log_X gain 1; of_v + ~ exp; v = V s+ ~
    as = a keep product velocity        # the velocity at the time when it is shown
    velocity_std = of_curve; vs = v; velocity = v + ~; share exp
    t = t - w hi+ w; if pos goto bent; velocity = v s- ~
bent:; edges tick by; edges velocity product shown
    t; if pos goto placed; vs = velocity; as = zero; velocity_std = of_straight; }
    serial {; log_X + log_64; if pos goto curved; of_v = log_T - of_slope
    t + ~ + ~; if pos goto curved; of_v + ~ exp; as = zero; velocity_std = of_straight
    vs = v s- ~; velocity = sum; log_X gain 0; goto placed
curved:
    as = a product velocity; velocity_std = of_curve; vs = v; velocity = sum + ~
    log_X gain 0; }
placed:
    serial {; e keep; of_e + ~ exp
    noises = noises + noises_one min noises_most; p = P s+ ~; }
    reads {; e - lag keep log; more = zero; log_X + log_3_2 + ~ exp
    lag = lag s+ ~ keep log             # half of it is shown as well, where an acceleration is
    velocity_std - of_curve; block if neg goto lagless; serial if neg goto place
    w = log_half + ~; log_X gain 3; w + log_X - log_dt + of_velocity + ~ exp
    vs = vs s+ ~; velocity = velocity s+ ~; log_X gain 0; w + log_X + ~ exp
    more = zero s- ~; lag over 1; more = more + ~; }
    block {
    reads lagless:; reads tick by; reads velocity product shown
    least_shown + ~ lo+ all_shown hi+ least_shown out velocity; settles speed = sum
made:
    edges w = doubt + log_X - slips hi+ slips; reads w = doubt + log_X; limit + w over 1
    edges quiet = $last; velocity_std - log_T + ~ exp; after - one; if neg goto same_place
    noises = noises + noises_one min noises_most
    w = ~; log_X gain 0; e keep; log_e + log_X + ~ exp
    edges lost = slips hi+ lost; edges slips = slips lo+ fade max none
    edges moved = $moved; edges edge = raw - moved; since = tau; p = P - moved s+ ~; }
place:                                  # and the place at the end of the tick
    since by; block least = one; as product half_velocity; v keep; t = zero s+ v min most
    vs + ~ product place; block slope by
    v = zero s+ t; serial least = one; edges if empty goto seen
    edges p + ~ out position_fine; reads p + more + ~ out position_fine
    serial {; shown:; tick by; velocity product shown
    edges w = doubt + log_X - slips hi+ slips; reads w = doubt + log_X  # D·√X, more if errors keep a sign
    triple = step + D; t = ~; limit + w over 1; velocity_std - log_T + ~ exp
    t min most_shown max least_shown out velocity; settles speed = sum; t = ~; slope by
    settles if empty goto settle; }
told:
    as product acceleration
    serial t max least min most_std out velocity_std; block w max least min most_std out velocity_std
    ~ out acceleration
    settles {; if empty goto end; speed log; mark = ~ + log_half max log_9_4; reach = half
    bar = minus_quarter + minus_sixteenth + minus_sixteenth; }
    after - one; if neg goto fewer
learn:                                  # nothing below is in a hurry
    edges e - lag keep log; serial edges lost = slips hi+ lost  # counts were lost or added, and now the place is right
    edges log_X + log_3_2 + ~ exp
    noises = noises max noises_first    # an upset may have made it less
    block sum min noises_offset by; edges lag = lag s+ ~; e over 1; t = e - before keep
    block log_X + log_256 max trouble; serial log_X + log_256; serial if pos goto short; serial trouble
    if pos goto short; t = e + ~ keep
short:
    serial noises min noises_offset by; before = e
    serial edges slips = slips lo+ fade max none
    block step = D + D + D; block zero - D s+ t min step over by; block period step = step - D
    serial zero s+ t - D min triple over by; a keep; t = zero s+ a min most
    D = D + ~ min most_noise max least_noise; a = zero s+ t
    edges if one goto offsets; period v log; period log_X + past_4; period if neg goto offsets
ready:                                  # growth of the memory and noise, for the next event
    smooth a keep log; smooth log_T - of_slope + ~ exp  # in the middle of the memory
    smooth of_v = v s- ~; smooth tick by; smooth of_v product shown
    serial smooth of_v = ~ min most_shown max least_shown
    block smooth of_v = least_shown + ~ lo+ all_shown hi+ least_shown; smooth T over 1
    smooth of_e = ahead + ~             # of_v and of_e hold its velocity and age for the next tick
    D log; minus_Ds = zero - D; growth = zero; after = minus_one; limit = order + ~ + ~
    lag log; serial w = order_lag - log_X - limit; edges slack = half
    block trouble = order_lag - log_X - limit + ~ + ~
    serial trouble = ~ + w + ~          # lag² over 7/2 U
    D over 2; log_X + log_256; if neg goto long
    edges {; log_X + log_64; if neg goto some
    w = minus_Ds min minus_sixteenth    # −D_a
    log_X + past_8; if neg goto scaled; slack = half - minus_Ds - minus_Ds; }
scaled:
    doubt = trouble + log_9_4 hi+ log_8
    edges minus_D3 = w + w + w; edges minus_D4 = sum + w
    reads {; w = minus_Ds + minus_Ds + minus_Ds; minus_D4 = sum + minus_Ds min minus_change
    minus_D3 = w min minus_mean; }
judged:
    waits far = w + w + w + w + w + minus_Ds min least_far; trouble; if neg goto grows
    sum - log_4; if neg goto shrinks; sum - log_4; if neg goto halves; slow_T = T + T
    growth = zero - count               # that outweighs any logarithm
    growing = log_T - log_half
end:; end
fewer:
    sum + one; if neg goto end; goto ready
halves:; slow_T = T + T
shrinks:; growth = zero - count; growing = log_T + log_half; end
edges {; some:
    w = minus_Ds - ~ min minus_sixteenth; goto five; }
long:
    trouble = trouble - log_9_4; minus_Ds = minus_Ds - ~ - ~
    edges w = sum min minus_sixteenth
five:
    doubt = trouble + log_9_4 hi+ log_8
    edges minus_D3 = w + w + w; edges minus_D4 = sum + w + w    # five of them
    reads {; w = minus_Ds + minus_Ds + minus_Ds; minus_D4 = sum + minus_Ds + minus_Ds min minus_change
    minus_D3 = w min minus_mean; }
    goto judged
grows:
    growing = log_T; T - slow_T; if pos goto end
    serial growing = log_T + log_eighth; block growing = log_T - log_8; end
edges {; single:
    plain $places keep; tau = $times; plain raw = zero s+ half; map raw = $places
    c = sum - o@last; serial quiet = $last; since = $length + since min most_since
    dt = sum - tau max clock log; turn = turn + one chance; serial moved = $moved
    block dt by; block log_dt = ~; phase; goto known; }
kinds {; offsets:
    edges log_X + past_4; edges if pos goto ready
    period log_T - of_period + ~; period if neg goto ready
    noises max noises_least by; e keep
    edges zero s+ e min half over by    # a quarter of what the kind's offset learns
    period zero s+ e min step over by; edges o@last = o@last s+ ~ s+ ~ s+ ~ s+ ~
    period t = zero s+ ~; period o@last = o@last + t + t + t + t
    o0 = o0 s- ~; edges o1 = o1 s- ~; o2 = o2 s- ~; edges o3 = o3 s- ~; period o4 = o4 s- ~; period o6 = o6 s- ~
    period $places by; period t + t + t + t product mean    # the next one has its share
    period o@last = o@last - ~; period o@up = o@up + ~; goto ready; }
lone:
    serial e = c - P keep log; serial edges edge = raw - moved
    smooth since + of_e out smooth_delay; smooth of_v out velocity_smooth; serial since = tau
    memory = T + step min most_memory max clock; serial P = P - moved
    block log_dt + log_many exp; block x = memory - ~ lo+ ~; block e = c - P keep log
    block edges u s- e; block edges if neg goto slip; goto heard
alone:
    waits far s+ e; waits if pos goto later; mu = mu + ~; edges slips = slips min zero
    block log_dt + log_8 exp; serial since + ahead by; serial log_dt + log_8 exp
    T = memory - ~ lo+ ~ log; slow_T = zero; goto sized
calm:; T = memory log; goto sized
edges {; slip:                          # counts were lost or added, or the offset was upset
    block moved = $moved; o@last = o@last min quarter max minus_quarter
    slips = slips hi+ one; sum - three; if pos goto begin
    log_dt + log_4 - log_T - one; if pos goto begin
    p = c - moved; block edge = raw - moved; block since = tau; goto show; }
first:
    p = c - moved; edges edge = raw - moved; since = tau
    phase = minus_one; block edges quiet = $last; goto nothing
young:; block edges moved = $moved
    serial log_dt = ~; smooth zero + zero out smooth_delay; smooth sum out velocity_smooth
    phase + one; if neg goto first
begin:
    e = c - p keep log; reads more = zero; edges slips = none; edges lost = zero; edges edge = raw - moved
    of_velocity - log_dt + ~ exp; phase = zero; since = tau; p = c - moved; v = zero s+ ~
    vs = sum; a = zero; as = zero; mu = zero; lag = zero
    before = zero; slow_T = zero; serial T = dt; serial log_T = log_dt
    block reads T = dt; block reads log_T = log_dt
    log_X = log_quarter; after = zero; velocity_std = of_curve
    serial edges if one goto show
    edges log_T = log_dt - log_64 - log_half exp   # means of many counts are by logarithms: they are forgotten
    edges T = ~; serial goto show
    block P = zero; block tick by; block velocity = v product shown
    block least_shown + ~ lo+ all_shown hi+ least_shown out velocity; block settles speed = sum
    block edges if one goto begun; block goto made
    block edges begun:; block edges T = dt; block edges log_T = log_dt; block edges goto made
edges {; same:; block moved = $moved
    smooth since + of_e out smooth_delay; smooth of_v out velocity_smooth
    edge = edge - moved; p = p - moved; goto show; }
waits {; later:                         # the next read is taken, wherever it is
    since = tau + dt out standstill; p = p - moved; far = zero - most; goto show; }
silent:
    since = $length + since min most_since; edges quiet = $length + quiet max zero min most
    edges sum - max_time out standstill + max_time - forget; edges if pos goto rest
    reads $last - most_silent out standstill; reads if pos goto rest; phase; if neg goto nothing
    smooth since + of_e out smooth_delay; smooth of_v out velocity_smooth
    reads $last - carried; reads if neg goto show; reads as = zero
show:
    since + ahead by; as product velocity; block tick by; block P = zero
    serial velocity = vs + ~; block velocity = vs + ~ product shown
    block edges if empty goto place
    block least_shown + ~ lo+ all_shown hi+ least_shown out velocity
    block settles speed = sum; block goto made; serial goto place
edges {; seen:
    P = p + ~ keep; if neg goto below; plain sum + o@up; map t = $places; map P + o@up - t
    goto beyond
below:
    plain zero - P - o@down; map t = $places; map t - P - o@down
beyond:
    max zero; t = sum - half; if neg goto still
    P = P s- t                          # at the next edge
    w = minus_D3 + minus_Ds + minus_Ds; half - slack; if pos goto sure
    w = zero - half - quarter max w
sure:
    t = t + w; if neg goto still; zero - lost; if pos goto trusted
    t = t - count - count - count - count; if neg goto still
trusted:
    quiet + ahead log; w = zero; t - half; if neg goto whole; w = log_5_8
whole:
    w = of_speed - ~ - w exp; t = zero s+ velocity - ~ lo+ ~
    w + of_bound exp                    # the error is at most the bound
    velocity = zero s+ t; least = ~
still:
    P out position_fine; quiet - max_time; if neg goto shown; velocity = zero; goto quiet; }
rest:
    phase = minus_two; since = zero; p = zero
nothing:
    velocity_std = none; least = zero; velocity = zero
    smooth sum out smooth_delay; smooth sum out velocity_smooth; p out position_fine; settles P = sum
quiet:
    as = zero; serial goto shown
    block {; shown:; tick by; velocity product shown
    edges w = doubt + log_X - slips hi+ slips; reads w = doubt + log_X
    least_shown + ~ lo+ all_shown hi+ least_shown out velocity; settles speed = sum
    limit + w over 1; velocity_std - log_T + ~ exp; w = ~; slope by; settles if empty goto settle; settles goto told
    as product acceleration; w max least min most_std out velocity_std; ~ out acceleration; end
same_place:; w = ~; goto place; }
"""
