@ d += a b as a product and a sum: two cycles on a Cortex-M4, where the single instruction takes
@ three. The products come before the sums, so that none waits for its own.
.macro mla3 d0, d1, d2, a0, a1, a2, b, t0, t1, t2
    vmul.f32 \t0, \a0, \b
    vmul.f32 \t1, \a1, \b
    vmul.f32 \t2, \a2, \b
    vadd.f32 \d0, \d0, \t0
    vadd.f32 \d1, \d1, \t1
    vadd.f32 \d2, \d2, \t2
.endm
.macro mla d, a, b, t
    vmul.f32 \t, \a, \b
    vadd.f32 \d, \d, \t
.endm
.macro mls d, a, b, t
    vmul.f32 \t, \a, \b
    vsub.f32 \d, \d, \t
.endm
@ d -= a b in two steps with others between them; b is lost
.macro product a, b
    vmul.f32 \b, \a, \b
.endm
.macro less d, a, b
    vsub.f32 \d, \d, \b
.endm
