    .section .start, "ax"
    .global start
start:
    la t0, fault
    csrw mtvec, t0
    la sp, __stack
    j main
    .balign 4
fault:
    li a0, 0x18
    li a1, 0x20023
    .option push
    .option norvc
    .balign 16
    slli x0, x0, 0x1f
    ebreak
    srai x0, x0, 7
    .option pop
    j fault
