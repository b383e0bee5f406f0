    .syntax unified
    .section .vectors, "a"
    .word __stack
    .word start
    .word fault, fault, fault, fault, fault, fault
    .word 0, 0, 0, fault, fault, 0, fault, fault

    .section .start, "ax"
    .thumb_func
    .global start
start:
    ldr r0, =0xe000ed88 @ CPACR
    ldr r1, =0x00f00000 @ the FPU, where there is one
    str r1, [r0]
    dsb
    isb
    bl main
    .thumb_func
fault:
    ldr r1, =0x20023 @ an error while running
    movs r0, #0x18
    bkpt 0xab
    b fault
    .pool
