// Conversions between the units of case files and the internal ones (micrometre, microsecond, picogram; so force is
// nN, stress kPa, energy fJ, viscosity mPa s). Nothing else in the program converts units.
#pragma once

namespace corpuscle::units {

inline constexpr double mm_per_s = 1e-3;                // um/us
inline constexpr double uN_per_m = 1e-3;                // nN/um
inline constexpr double pN = 1e-3;                      // nN
inline constexpr double Pa = 1e-3;                      // kPa
inline constexpr double J = 1e15;                       // fJ
inline constexpr double N_s_per_m = 1e9;                // nN us/um, surface viscosity
inline constexpr double rad_per_s = 1e-6;               // rad/us
inline constexpr double degree = 0.017453292519943295;  // rad

}  // namespace corpuscle::units
