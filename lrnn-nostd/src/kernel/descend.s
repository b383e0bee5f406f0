@ void descend(weights r0, s_3 r1, g s0-s2): theta -= sum_j g_j s_3,j, seven at a time

.macro moved theta, a, b, c
    mls \theta, s0, \a, s31
    mls \theta, s1, \b, s31
    mls \theta, s2, \c, s31
.endm

.macro descend
    vpush {d8-d15}
    movs r2, #9
4:  vldm r1!, {s3-s23}
    vldm r0, {s24-s30}
    moved s24, s3, s4, s5
    moved s25, s6, s7, s8
    moved s26, s9, s10, s11
    moved s27, s12, s13, s14
    moved s28, s15, s16, s17
    moved s29, s18, s19, s20
    moved s30, s21, s22, s23
    vstm r0!, {s24-s30}
    subs r2, r2, #1
    bne 4b
    vpop {d8-d15}
    bx lr
.endm
