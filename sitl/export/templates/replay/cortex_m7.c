/* What a Cortex-M7 without an operating system needs before the C library's start: vectors, its FPU, a counter.
 *
 * QEMU counts one instruction as a nanosecond (-icount shift=0); the board's SysTick runs at 25 MHz. */
#include <stdint.h>

extern void _start(void);
void reset(void);
unsigned long instructions(void);

#define CPACR (*(volatile uint32_t *)0xE000ED88u)
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)
#define NANOSECONDS 40u /* of a tick */

__attribute__((section(".vectors"), used)) static const uintptr_t vectors[] = {0x20400000u, (uintptr_t)reset};

void reset(void) {
    CPACR |= 0xFu << 20;
    SYST_RVR = 0xFFFFFFu;
    SYST_CVR = 0;
    SYST_CSR = 5;
    _start();
}

unsigned long instructions(void) {
    static uint32_t last = 0xFFFFFFu, sum;
    const uint32_t now = SYST_CVR;
    sum += (last - now) & 0xFFFFFFu;
    last = now;
    return (unsigned long)sum * NANOSECONDS;
}
