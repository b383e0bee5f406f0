@ u32 advance(net r0, s_1 s_2 s_3 r1, forward r2, y(k-1) r3): 0 when nothing overflowed

@ Three own parameters. r s0-s8, temporaries s9-s11; before s23-s31, after s20-s28: each of the
@ three overwrites the previous one.
.macro three more
    vldm r1, {s23-s31}
    fed_back s20, s21, s22, s23, s24, s25
    \more\()_a
    fed_back s23, s24, s25, s26, s27, s28
    \more\()_b
    fed_back s26, s27, s28, s29, s30, s31
    \more\()_c
    vstm r1!, {s20-s28}
.endm
.macro fed_back d0, d1, d2, a, b, c
    vmul.f32 \d0, s0, \a
    vmul.f32 \d1, s3, \a
    vmul.f32 \d2, s6, \a
    mla3 \d0, \d1, \d2, s1, s4, s7, \b, s9, s10, s11
    mla3 \d0, \d1, \d2, s2, s5, s8, \c, s9, s10, s11
.endm
@ slope_p d_q (s15-s17, s12-s14) for W_pq and R_pq, q = a, b, c
.macro p0_a
    mla s20, s15, s12, s9
.endm
.macro p0_b
    mla s23, s15, s13, s9
.endm
.macro p0_c
    mla s26, s15, s14, s9
.endm
.macro p1_a
    mla s21, s16, s12, s9
.endm
.macro p1_b
    mla s24, s16, s13, s9
.endm
.macro p1_c
    mla s27, s16, s14, s9
.endm
.macro p2_a
    mla s22, s17, s12, s9
.endm
.macro p2_b
    mla s25, s17, s13, s9
.endm
.macro p2_c
    mla s28, s17, s14, s9
.endm
@ slope_p for b_p, p = a, b, c
.macro bias_a
    vadd.f32 s20, s20, s15
.endm
.macro bias_b
    vadd.f32 s24, s24, s16
.endm
.macro bias_c
    vadd.f32 s28, s28, s17
.endm
@ the same where slope is 1
.macro one0_a
    vadd.f32 s20, s20, s12
.endm
.macro one0_b
    vadd.f32 s23, s23, s13
.endm
.macro one0_c
    vadd.f32 s26, s26, s14
.endm
.macro one1_a
    vadd.f32 s21, s21, s12
.endm
.macro one1_b
    vadd.f32 s24, s24, s13
.endm
.macro one1_c
    vadd.f32 s27, s27, s14
.endm
.macro one2_a
    vadd.f32 s22, s22, s12
.endm
.macro one2_b
    vadd.f32 s25, s25, s13
.endm
.macro one2_c
    vadd.f32 s28, s28, s14
.endm

@ The 21 own parameters; d is y_l-1 for W, then y_l(k-1) for R.
.macro own prefix
    three \prefix\()0
    three \prefix\()1
    three \prefix\()2
    vldm r3!, {s12-s14}
    three \prefix\()0
    three \prefix\()1
    three \prefix\()2
    three bias
.endm

@ One inherited parameter. r s0-s8, w s18-s26, last s9-s11, below s12-s14, temporaries s15-s17,
@ after s27-s29.
.macro inherited
    vldm r1, {s9-s11}
    vldm r4!, {s12-s14}
    vmul.f32 s27, s0, s9
    vmul.f32 s28, s3, s9
    vmul.f32 s29, s6, s9
    mla3 s27, s28, s29, s1, s4, s7, s10, s15, s16, s17
    mla3 s27, s28, s29, s2, s5, s8, s11, s15, s16, s17
    mla3 s27, s28, s29, s18, s21, s24, s12, s15, s16, s17
    mla3 s27, s28, s29, s19, s22, s25, s13, s15, s16, s17
    mla3 s27, s28, s29, s20, s23, s26, s14, s15, s16, s17
    vstm r1!, {s27-s29}
.endm

@ slope = 1 - y^2 and R scaled by it, row by row
.macro slopes
    vldm r2, {s9-s11}
    vmov.f32 s15, #1.0
    vmov.f32 s16, #1.0
    vmov.f32 s17, #1.0
    mls s15, s9, s9, s18
    mls s16, s10, s10, s19
    mls s17, s11, s11, s20
    scaled s0, s1, s2, s15
    scaled s3, s4, s5, s16
    scaled s6, s7, s8, s17
.endm
.macro scaled a, b, c, slope
    vmul.f32 \a, \a, \slope
    vmul.f32 \b, \b, \slope
    vmul.f32 \c, \c, \slope
.endm
.macro seven
    inherited
    inherited
    inherited
    inherited
    inherited
    inherited
    inherited
.endm

.macro advance
    push {r4, lr}
    vpush {d8-d15}
    @ The unit's own flags tell whether a finite operand gave an infinite result or NaN.
    vmrs r4, fpscr
    bic r4, r4, #0x9f
    vmsr fpscr, r4
    @ layer 1: R at 36
    add ip, r0, #36
    vldm ip, {s0-s8}
    vldm r2!, {s12-s14}
    slopes
    own p
    @ layer 2: R at 120; its own parameters 252 bytes behind those it inherits
    add ip, r0, #120
    vldm ip, {s0-s8}
    vldm r2!, {s12-s14}
    slopes
    add r1, r1, #252
    own p
    sub r1, r1, #504
    sub r4, r1, #252
    add ip, r0, #84
    vldm ip, {s18-s26}
    scaled s18, s19, s20, s15
    scaled s21, s22, s23, s16
    scaled s24, s25, s26, s17
    mov lr, #3
2:  seven
    subs lr, lr, #1
    bne 2b
    @ layer 3, of slope 1: R at 204; 42 inherited columns before its own
    add ip, r0, #204
    vldm ip, {s0-s8}
    vldm r2!, {s12-s14}
    vmov.f32 s15, #1.0
    vmov.f32 s16, #1.0
    vmov.f32 s17, #1.0
    add r1, r1, #756
    own one
    sub r1, r1, #756
    add ip, r0, #168
    vldm ip, {s18-s26}
    mov lr, #6
3:  seven
    subs lr, lr, #1
    bne 3b
    vmrs r0, fpscr
    and r0, r0, #5
    vpop {d8-d15}
    pop {r4, pc}
.endm
