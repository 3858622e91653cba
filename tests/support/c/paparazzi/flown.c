/* A vehicle that hovers under the module for some ticks, off where it is to be; prints its actuators. */
#include "modules/ctrl_darko/ctrl_darko.h"
#include "autopilot.h"
#include "modules/actuators/actuators.h"
#include "state.h"
#include <stdio.h>
#include <stdlib.h>

struct NedCoor_f position, speed, acceleration;
struct FloatQuat attitude;
struct FloatRates rates;
int16_t actuators_pprz[ACTUATORS_NB];
static bool flies = true;

bool autopilot_in_flight(void) { return flies; }
bool autopilot_get_motors_on(void) { return true; }

/* Arguments: the attitude in NED, the pitch rate, whether it flies. */
int main(int n, char **words) {
  int32_t cmd[4] = {0};
  if (n != 7) {
    return 1;
  }
  attitude = (struct FloatQuat){strtof(words[1], NULL), strtof(words[2], NULL), strtof(words[3], NULL),
                                strtof(words[4], NULL)};
  rates = (struct FloatRates){0.f, strtof(words[5], NULL), 0.f};
  flies = words[6][0] == '1';
  position = (struct NedCoor_f){1.f, 2.f, -20.f};
  ctrl_darko_init();
  ctrl_darko_enter();
  for (int i = 0; i < 50; ++i) {
    ctrl_darko_run(flies, true, cmd);
  }
  printf("%d %d %d %d law %d status %d thrust %d\n", actuators_pprz[0], actuators_pprz[1], actuators_pprz[2],
         actuators_pprz[3], (int)ctrl_darko.law, (int)ctrl_darko.status, (int)cmd[3]);
  return 0;
}
