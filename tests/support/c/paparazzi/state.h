#ifndef STATE_H
#define STATE_H
struct NedCoor_f { float x, y, z; };
struct FloatQuat { float qi, qx, qy, qz; };
struct FloatRates { float p, q, r; };
extern struct NedCoor_f position, speed, acceleration;
extern struct FloatQuat attitude;
extern struct FloatRates rates;
static inline struct NedCoor_f *stateGetPositionNed_f(void) { return &position; }
static inline struct NedCoor_f *stateGetSpeedNed_f(void) { return &speed; }
static inline struct NedCoor_f *stateGetAccelNed_f(void) { return &acceleration; }
static inline struct FloatQuat *stateGetNedToBodyQuat_f(void) { return &attitude; }
static inline struct FloatRates *stateGetBodyRates_f(void) { return &rates; }
static inline float stateGetAirspeed_f(void) { return 0.f; }
#endif
