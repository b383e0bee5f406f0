@ int descend(weights r0, s_3 r1, g s0-s2): theta -= sum_j g_j s_3,j, seven at a time. When a weight
@ is not finite all are restored and the result is not 0. All that comes in is finite.

@ One g_j with its value of each of the seven.
.macro part g, a, b, c, d, e, f, h
    product \g, \a
    product \g, \b
    product \g, \c
    product \g, \d
    product \g, \e
    product \g, \f
    product \g, \h
    less s24, \g, \a
    less s25, \g, \b
    less s26, \g, \c
    less s27, \g, \d
    less s28, \g, \e
    less s29, \g, \f
    less s30, \g, \h
.endm

@ The 63 weights from one place to another; both pointers end behind them.
.macro copy from, to
    vldm \from!, {s3-s23}
    vstm \to!, {s3-s23}
    vldm \from!, {s3-s23}
    vstm \to!, {s3-s23}
    vldm \from!, {s3-s23}
    vstm \to!, {s3-s23}
.endm

.macro descend
    vpush {d8-d15}
    sub sp, sp, #256
    mov r2, sp
    copy r0, r2
    sub r0, r0, #252
    vmrs r3, fpscr
    bic r3, r3, #0x9f
    vmsr fpscr, r3
    movs r2, #9
4:  vldm r1!, {s3-s23}
    vldm r0, {s24-s30}
    part s0, s3, s6, s9, s12, s15, s18, s21
    part s1, s4, s7, s10, s13, s16, s19, s22
    part s2, s5, s8, s11, s14, s17, s20, s23
    vstm r0!, {s24-s30}
    subs r2, r2, #1
    bne 4b
    vmrs r3, fpscr
    ands r3, r3, #5
    bne 5f
6:  add sp, sp, #256
    vpop {d8-d15}
    mov r0, r3
    bx lr
5:  sub r0, r0, #252
    mov r2, sp
    copy r2, r0
    b 6b
.endm
