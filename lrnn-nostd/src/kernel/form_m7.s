@ d += a b as one instruction that rounds twice, as Rust's code does. Fewest instructions; best on a
@ core that issues it every cycle.
.macro mla3 d0, d1, d2, a0, a1, a2, b, t0, t1, t2
    vmla.f32 \d0, \a0, \b
    vmla.f32 \d1, \a1, \b
    vmla.f32 \d2, \a2, \b
.endm
.macro mla d, a, b, t
    vmla.f32 \d, \a, \b
.endm
.macro mls d, a, b, t
    vmls.f32 \d, \a, \b
.endm
.macro product a, b
.endm
.macro less d, a, b
    vmls.f32 \d, \a, \b
.endm
