//! Against GNU's assembler: each line was assembled for a Cortex-M4 at the address in front of it,
//! and its halfwords were copied.

use super::What::*;
use super::*;

#[test]
fn what_moves_the_stack_pointer_is_as_the_assembler_wrote_it() {
    for (first, second, what) in [
        (0xb510, 0, Grow(8)),          // push {r4, lr}
        (0xe92d, 0x41f0, Grow(24)),    // push {r4-r8, lr}
        (0xf84d, 0xbd04, Grow(4)),     // str r11, [sp, #-4]!
        (0xe96d, 0x0104, Grow(16)),    // strd r0, r1, [sp, #-16]!
        (0xed2d, 0x8b06, Grow(24)),    // vpush {d8-d10}
        (0xed6d, 0x0a03, Grow(12)),    // vpush {s1-s3}
        (0xb0ff, 0, Grow(508)),        // sub sp, #508
        (0xf5ad, 0x5d80, Grow(4096)),  // sub.w sp, sp, #4096
        (0xf2ad, 0x4dd2, Grow(1234)),  // subw sp, sp, #1234
        (0xb004, 0, Grow(-16)),        // add sp, #16
        (0xf50d, 0x7d4c, Grow(-816)),  // add.w sp, sp, #816
        (0xf20d, 0x3dfc, Grow(-1020)), // addw sp, sp, #1020
        (0xbc30, 0, Grow(-8)),         // pop {r4, r5}
        (0xe8bd, 0x0300, Grow(-8)),    // pop {r8, r9}
        (0xf85d, 0xbb04, Grow(-4)),    // ldr r11, [sp], #4
        (0xecbd, 0x8b06, Grow(-24)),   // vpop {d8-d10}
        (0xbd10, 0, Return),           // pop {r4, pc}
        (0xe8bd, 0x81f0, Return),      // pop {r4-r8, pc}
        (0xf85d, 0xfb04, Return),      // ldr pc, [sp], #4
        (0x4770, 0, Return),           // bx lr
        (0x468d, 0, SetStack),         // mov sp, r1
        (0x448d, 0, Unknown),          // add sp, r1
        (0xebad, 0x0d04, Unknown),     // sub.w sp, sp, r4
        (0xf380, 0x8808, Unknown),     // msr msp, r0
        (0xf8d1, 0xf004, Unknown),     // ldr pc, [r1, #4]
        (0xe8b1, 0x8004, Unknown),     // ldmia r1!, {r2, pc}
        (0xee35, 0x4a04, Other),       // vadd.f32 s8, s10, s8
        (0xf855, 0x2f04, Other),       // ldr r2, [r5, #4]!
    ] {
        assert_eq!(
            decode(0x100, first, second).what,
            what,
            "{first:x} {second:x}"
        );
    }
}

#[test]
fn where_branches_lead_is_as_the_assembler_wrote_it() {
    for (address, first, second, what) in [
        (0x144, 0x4718, 0, JumpRegister(3)),     // bx r3
        (0x146, 0x47b8, 0, CallRegister(7)),     // blx r7
        (0x14c, 0xf000, 0xffd8, Call(0x1100)),   // bl 0x1100
        (0x150, 0xf7ff, 0xff96, Call(0x80)),     // bl 0x80
        (0x154, 0xf01f, 0xbfd4, Jump(0x20100)),  // b.w 0x20100
        (0x158, 0xe012, 0, Jump(0x180)),         // b 0x180
        (0x15a, 0xd0d1, 0, Branch(0x100)),       // beq 0x100
        (0x15c, 0xf003, 0x87d0, Branch(0x4100)), // beq.w 0x4100
        (0x160, 0xb3f3, 0, Branch(0x1e0)),       // cbz r3, 0x1e0
        (0x162, 0xbbfb, 0, Branch(0x1e4)),       // cbnz r3, 0x1e4
        (
            0x164,
            0xe8df,
            0xf001,
            Table {
                base: 15,
                halves: false,
            },
        ), // tbb [pc, r1]
        (
            0x168,
            0xe8df,
            0xf011,
            Table {
                base: 15,
                halves: true,
            },
        ), // tbh [pc, r1, lsl #1]
        (
            0x16c,
            0xe8d3,
            0xf001,
            Table {
                base: 3,
                halves: false,
            },
        ), // tbb [r3, r1]
        (0x170, 0xf20f, 0x0318, Address(3, 0x18c)), // addw r3, pc, #24
        (0x174, 0xa242, 0, Address(2, 0x280)),   // adr r2, 0x280
        (0x19a, 0xbf1e, 0, If(3, true)),         // ittt ne
        (0x1a2, 0xbf1a, 0, If(3, false)),        // itte ne
        (0x1aa, 0xde00, 0, Stop),                // udf #0
        (0x1ac, 0xbeab, 0, Stop),                // bkpt 0xab
        (0x1ae, 0xbf00, 0, Nothing),             // nop
    ] {
        assert_eq!(decode(address, first, second).what, what, "{address:x}");
    }
}

#[test]
fn where_values_come_from_is_as_the_assembler_wrote_it() {
    let load = |to, offset, frame| Load { to, offset, frame };
    for (first, second, what, writes) in [
        (0x4615, 0, Copy { to: 5, from: 2 }, 1 << 5), // mov r5, r2
        (0xf248, 0x21f1, Low(1, 33521), 1 << 1),      // movw r1, #33521
        (0xf6c0, 0x0100, High(1, 2048), 1 << 1),      // movt r1, #2048
        (0x6c82, 0, load(2, 72, false), 1 << 2),      // ldr r2, [r0, #72]
        (0x9a0b, 0, load(2, 44, true), 1 << 2),       // ldr r2, [sp, #44]
        (0xf8d8, 0x2c70, load(2, 3184, false), 1 << 2), // ldr r2, [r8, #3184]
        (0x910b, 0, Keep(1, 44), 1 << 1),             // str r1, [sp, #44]
        (0xf8cd, 0x902c, Keep(9, 44), 1 << 9),        // str.w r9, [sp, #44]
        (0xa90c, 0, FrameAddress(48), 1 << 1),        // add r1, sp, #48
        (0xf10d, 0x0868, FrameAddress(104), 1 << 8),  // add.w r8, sp, #104
        (0xf20d, 0x38fd, FrameAddress(1021), 1 << 8), // addw r8, sp, #1021
        (0xb510, 0, Grow(8), 0),                      // push {r4, lr}
        (0xbc30, 0, Grow(-8), 0x30),                  // pop {r4, r5}
        (0x4770, 0, Return, 0),                       // bx lr
        (0x47b8, 0, CallRegister(7), 0x500f),         // blx r7
        (0xf855, 0x2f04, Other, 1 << 2 | 1 << 5),     // ldr r2, [r5, #4]!
        (0xee35, 0x4a04, Other, 0),                   // vadd.f32 s8, s10, s8
    ] {
        let instruction = decode(0x100, first, second);
        assert_eq!(instruction.what, what, "{first:x} {second:x}");
        // one too many may be named, none too few
        assert_eq!(instruction.writes & writes, writes, "{first:x} {second:x}");
    }
    assert_eq!(
        decode(0x18c, 0xe9cd, 0x200c).what, // strd r2, r0, [sp, #48]
        KeepTwo([2, 0], 48)
    );
}
