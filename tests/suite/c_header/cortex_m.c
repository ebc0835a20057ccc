/* Start of a Cortex-M in QEMU, for a program that uses newlib with semihosting. */

#include <stdint.h>
extern uint32_t stack_top;
void _start(void);
void reset(void);
void reset(void)
{
#if defined(__ARM_FP)
    *(volatile uint32_t *)0xe000ed88 |= 0xful << 20; /* turns the floating-point unit on */
    __asm__ volatile("dsb\nisb");
#endif
#if defined(FLUSH_SUBNORMALS)
    __asm__ volatile("vmsr fpscr, %0" : : "r"(1ul << 24));
#endif
    _start();
}
__attribute__((section(".vectors"), used)) static const void *const vectors[] = {&stack_top, (void *)reset};
