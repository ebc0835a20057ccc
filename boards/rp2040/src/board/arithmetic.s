@ Sums, differences and products of f32, exactly as IEEE 754 has them: rounded to nearest, ties to even, with
@ subnormals, infinities and NaN. For a core without long multiply (Armv6-M) that multiplies 32 by 32 bits in a cycle.
@
@ Arguments are in r0 and r1, the result is in r0; r2, r3, r12 and flags are lost (run-time ABI for the Arm
@ architecture, 4.1.2). Comments write M for the 23 bits of the fraction, E for the 8 bits of the exponent, S for the
@ sign, and C for the carry, which after a shift is the last bit that was shifted out.

    .syntax unified
    .thumb
    .text
    .balign 4

    .global __aeabi_fsub
    .type __aeabi_fsub, %function
    .thumb_func
__aeabi_fsub:
    movs r2, #1
    lsls r2, #31
    eors r1, r2
    .size __aeabi_fsub, . - __aeabi_fsub

    .global __aeabi_fadd
    .type __aeabi_fadd, %function
    .thumb_func
__aeabi_fadd:
    movs r2, r0
    eors r2, r1
    bmi .Ldiffer

    @ Signs are equal. The larger one to r0.
    cmp r0, r1
    bhs 1f
    movs r2, r0
    movs r0, r1
    movs r1, r2
1:  lsrs r2, r0, #23
    lsrs r3, r1, #23
    mov r12, r2             @ S and E of the larger one
    uxtb r2, r2
    cmp r2, #255
    beq .Lreturn            @ an infinity or NaN
    uxtb r3, r3
    cmp r3, #0
    beq .Lsmall_addend
    subs r3, r2, r3         @ distance of the exponents
    movs r2, #1
    lsls r2, #30
    lsls r1, #9
    lsrs r1, #2
    adds r1, r2
.Ladd:
    @ Significands: the leading 1 in bit 30, seven bits below the last place.
    lsls r0, #9
    lsrs r0, #2
    adds r0, r2
    movs r2, r1
    lsrs r2, r3
    adds r2, r0
    bmi .Lcarry
    mov r0, r12
    mov r12, r1
    subs r0, #1             @ the leading 1 adds it again
    lsls r0, #23
    lsrs r1, r2, #7
    adcs r0, r1             @ rounds up if C
    lsls r2, #26
    beq .Ladd_even
    bx lr
.Lcarry:
    mov r0, r12
    mov r12, r1
    uxtb r1, r0
    cmp r1, #254
    beq .Ladd_infinite
    lsls r0, #23
    lsrs r1, r2, #8
    adcs r0, r1
    lsls r2, #25
    beq .Ladd_even
    bx lr
.Ladd_infinite:
    adds r0, #1
    lsls r0, #23
    bx lr

    @ Nothing follows the first bit that was rounded off, which is C. It has been a tie if the smaller one (r12) has lost
    @ nothing when it was shifted (by r3, at most 31 if C).
.Ladd_even:
    bcc .Lreturn
    movs r2, #32
    subs r2, r3
    mov r1, r12
    lsls r1, r2
    bne .Lreturn
    lsrs r0, #1
    lsls r0, #1
.Lreturn:
    bx lr

    @ The smaller one is 0 or subnormal.
.Lsmall_addend:
    lsls r1, #9
    beq .Lreturn
    cmp r2, #0
    beq .Lboth_subnormal
    subs r3, r2, #1
    movs r2, #1
    lsls r2, #30
    lsrs r1, #2
    b .Ladd
.Lboth_subnormal:
    lsrs r1, #9
    adds r0, r1
    bx lr

    @ Signs differ: a difference. r1 gets the sign of r0, and the larger one goes to r0.
.Ldiffer:
    movs r2, #1
    lsls r2, #31
    eors r1, r2
    cmp r0, r1
    bhi 1f
    beq .Lcancelled
    movs r3, r0
    eors r3, r2
    movs r0, r1
    eors r0, r2
    movs r1, r3
1:  lsrs r2, r0, #23
    lsrs r3, r1, #23
    mov r12, r2
    uxtb r2, r2
    cmp r2, #255
    beq .Lreturn
    uxtb r3, r3
    cmp r3, #1
    bls .Lsmall_subtrahend
    subs r3, r2, r3
    movs r2, #1
    lsls r2, #31
    lsls r1, #8
    orrs r1, r2
.Lsubtract:
    @ Significands: the leading 1 in bit 31, eight bits below the last place.
    lsls r0, #8
    orrs r0, r2
    movs r2, r1
    lsrs r2, r3
    subs r2, r0, r2
    bpl .Lshorter
    mov r0, r12
    mov r12, r1
    subs r0, #1
    lsls r0, #23
    lsrs r1, r2, #8
    adcs r0, r1
    lsls r2, #25
    beq .Lsubtract_even
    bx lr
.Lshorter:
    adds r2, r2
    bpl .Lmuch_shorter
    mov r0, r12
    mov r12, r1
    subs r0, #2
    lsls r0, #23
    lsrs r1, r2, #8
    adcs r0, r1
    lsls r2, #25
    beq .Lsubtract_even
    bx lr

    @ As above; but what was lost makes the difference smaller.
.Lsubtract_even:
    bcc .Lreturn
    movs r2, #32
    subs r2, r3
    mov r1, r12
    lsls r1, r2
    bne 1f
    lsrs r0, #1
    lsls r0, #1
    bx lr
1:  subs r0, #1
    bx lr

    @ At least two leading bits have cancelled: the exponents differ by at most 1, and nothing is rounded off.
.Lmuch_shorter:
    movs r1, #1             @ number of bits
    .irp bits, 16, 8, 4, 2, 1
    lsrs r0, r2, #(32 - \bits)
    bne 1f
    lsls r2, #\bits
    adds r1, #\bits
1:
    .endr
    mov r0, r12
    uxtb r3, r0
    subs r3, r1             @ E
    ble 1f
    subs r0, r1
    subs r0, #1
    lsls r0, #23
    lsrs r2, #8
    adds r0, r2
    bx lr
1:  movs r1, #9             @ subnormal
    subs r1, r3
    lsrs r2, r1
    lsrs r0, #8
    lsls r0, #31
    orrs r0, r2
    bx lr

    @ The smaller one has an exponent of 0 or 1.
.Lsmall_subtrahend:
    cmp r2, #1
    bls .Lboth_small
    lsls r1, #9
    cmp r3, #0
    beq 1f
    subs r3, r2, #1
    movs r2, #1
    lsls r2, #31
    lsrs r1, #1
    orrs r1, r2
    b .Lsubtract
1:  cmp r1, #0
    beq .Lreturn
    subs r3, r2, #1
    movs r2, #1
    lsls r2, #31
    lsrs r1, #1
    b .Lsubtract
.Lboth_small:
    subs r1, r0, r1
    lsrs r0, #31
    lsls r0, #31
    orrs r0, r1
    bx lr
.Lcancelled:
    lsrs r0, #23
    uxtb r0, r0
    cmp r0, #255
    beq .Lnan
    movs r0, #0
    bx lr
.Lnan:
    movs r0, #255
    lsls r0, #1
    adds r0, #1
    lsls r0, #22
    bx lr
    .size __aeabi_fadd, . - __aeabi_fadd

    .balign 4
    .global __aeabi_fmul
    .type __aeabi_fmul, %function
    .thumb_func
__aeabi_fmul:
    lsrs r2, r0, #23
    lsrs r3, r1, #23
    mov r12, r2
    add r12, r3             @ sum of both S and E: bit 8 becomes the sign of the product
    uxtb r2, r2
    uxtb r3, r3
    subs r2, #1
    cmp r2, #254
    bhs .Lslow_product
    subs r3, #1
    cmp r3, #254
    bhs .Lslow_product
    adds r2, r3
    subs r2, #126
    cmp r2, #253
    bhs .Lslow_product      @ too large or too small, perhaps
    @ 24 bits by three times 8 bits.
    movs r2, #128
    lsls r3, r2, #24
    lsls r1, #8
    orrs r1, r3
    lsrs r1, #8
    lsrs r3, r0, #16
    orrs r2, r3
    uxtb r2, r2
    muls r2, r1
    lsrs r3, r0, #8
    uxtb r3, r3
    muls r3, r1
    uxtb r0, r0
    muls r1, r0
    lsrs r0, r1, #8
    adds r0, r3
    mov r3, r12
    orrs r1, r0             @ its last 8 bits are below r2
    lsrs r0, #8
    adds r2, r0             @ the first 32 of 48 bits
    bmi 1f
    adds r2, r2
    subs r3, #1
1:  subs r3, #127
    lsls r3, #23
    lsrs r0, r2, #8
    adcs r0, r3             @ rounds up if C
    lsls r2, #25
    beq 1f
    bx lr
1:  bcc 1f
    lsls r1, #24
    bne 1f
    lsrs r0, #1             @ a tie
    lsls r0, #1
1:  bx lr

    @ An exponent is 0 or 255, or that of the product may be too small or too large.
.Lslow_product:
    lsls r3, r1, #1
    lsls r2, r0, #1
    beq .Lproduct_zero
    cmp r3, #0
    bne .Lslow_operands
    movs r3, r2
.Lproduct_zero:             @ r3: the other one
    eors r0, r1
    lsrs r0, #31
    lsls r0, #31
    lsrs r3, #24
    cmp r3, #255
    beq .Lnan
    bx lr

    @ An operand is infinite or NaN, and none is 0.
.Lproduct_infinite:
    movs r2, #255
    lsls r2, #24
    lsls r3, r0, #1
    cmp r3, r2
    bhi .Lnan
    lsls r3, r1, #1
    cmp r3, r2
    bhi .Lnan
    eors r0, r1
    lsrs r0, #31
    lsls r0, #8
    adds r0, #255
    lsls r0, #23
    bx lr
.Lslow_operands:
    lsrs r2, #24
    cmp r2, #255
    beq .Lproduct_infinite
    lsrs r3, #24
    cmp r3, #255
    beq .Lproduct_infinite
    push {r4, r5, r6, lr}
    movs r4, r0
    eors r4, r1
    lsrs r4, #31
    lsls r4, #31            @ the sign
    movs r5, #1
    lsls r5, #23
    lsls r0, #9
    lsrs r0, #9
    cmp r2, #0
    beq 1f
    adds r0, r5
    subs r2, #1
1:  lsls r1, #9
    lsrs r1, #9
    cmp r3, #0
    beq 1f
    adds r1, r5
    subs r3, #1
    @ The product of the significands counts 2^-149 after it is shifted right by 16 and by r3.
1:  adds r2, r3
    movs r3, #133
    subs r3, r2
    cmp r3, #33
    bge .Lproduct_vanishes
    uxtb r2, r0
    muls r2, r1
    lsrs r5, r0, #8
    uxtb r5, r5
    muls r5, r1
    lsrs r0, #16
    muls r0, r1
    lsrs r1, r2, #8
    adds r1, r5
    lsrs r5, r1, #8
    adds r0, r5             @ the first 32 bits; the other 16 to the high half of r1
    lsls r1, #24
    lsls r2, #24
    lsrs r2, #8
    orrs r1, r2
    movs r5, #0
    cmp r3, #8
    bge .Lround_product
    @ Perhaps not subnormal: the leading 1 goes to bit 31.
    .irp bits, 16, 8, 4, 2, 1
    lsrs r2, r0, #(32 - \bits)
    bne 1f
    lsls r0, #\bits
    lsrs r2, r1, #(32 - \bits)
    orrs r0, r2
    lsls r1, #\bits
    adds r3, #\bits
1:
    .endr
    cmp r3, #8
    bge .Lround_product
    movs r5, #8
    subs r5, r3             @ E, without the 1 that the leading bit adds
    movs r3, #8
    cmp r5, #254
    bge .Lproduct_overflows
    lsls r5, #23
.Lround_product:
    movs r2, #33
    subs r2, r3
    movs r6, r0
    lsls r6, r2
    orrs r1, r6             @ what follows the first bit that is rounded off
    lsrs r0, r3
    bcc 1f
    adds r0, #1
    cmp r1, #0
    bne 1f
    lsrs r0, #1             @ a tie
    lsls r0, #1
1:  adds r0, r5
    orrs r0, r4
    pop {r4, r5, r6, pc}
.Lproduct_vanishes:
    movs r0, r4
    pop {r4, r5, r6, pc}
.Lproduct_overflows:
    movs r0, #255
    lsls r0, #23
    orrs r0, r4
    pop {r4, r5, r6, pc}
    .size __aeabi_fmul, . - __aeabi_fmul
