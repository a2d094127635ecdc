// Analogue part of the virtual rig: sensor outputs of a motion, and the connections of a fast control loop.
#pragma once
#include "controller.hpp"
#include "shaker.hpp"
#include "signal.hpp"

namespace vibench {

// Computes the output voltage of a sensor for the steps `begin` to `stop` - 1.
inline void show(const Sensor &sensor, int64_t begin, int64_t stop) {
  double *volts = sensor.volts.at, most = sensor.full_scale_voltage, scale = most / sensor.full_scale;
  run_filter(sensor.filter, sensor.motion.at + begin, volts + begin, stop - begin);
  for (int64_t n = begin; n < stop; n++) {
    double seen = volts[n] + sensor.noise.at[n];
    if (sensor.instead.size > 0 && sensor.instead.at[n] == sensor.instead.at[n]) seen = sensor.instead.at[n];
    volts[n] = smaller(larger(seen * scale, -most), most);
  }
}

inline int64_t show(const Sensor &sensor) {
  show(sensor, 0, sensor.motion.size);
  return 0;
}

// Adds a controller's delayed output to the drive, from `begin` to the controller's next sample (`stop`).
inline int64_t play_loop(LoopCables &loop) {
  int64_t each = loop.steps_per_sample, into = (loop.first + loop.begin) % each;
  double *late = loop.late.at, *drive = loop.drive.at + loop.begin;
  if (into == 0) {
    double count = larger(loop.steps_heard, 1.0);
    double volts = answer(*loop.controller, loop.base_sum / count, loop.m0_sum / count);
    loop.base_sum = loop.m0_sum = loop.steps_heard = 0.0;
    for (int64_t k = loop.late.size - each; k < loop.late.size; k++) late[k] = volts;
  }
  loop.stop = smaller(loop.begin + each - into, loop.drive.size);
  int64_t count = loop.stop - loop.begin;
  for (int64_t k = 0; k < count; k++) drive[k] += late[k];
  for (int64_t k = count; k < loop.late.size; k++) late[k - count] = late[k];
  for (int64_t k = loop.late.size - count; k < loop.late.size; k++) late[k] = 0.0;
  return loop.stop;
}

// Adds the sensor voltages of the simulated steps to the controller's sums, and moves `begin` to the next
// steps. Returns 1 if the host must act before the controller's next sample.
inline int64_t hear_loop(LoopCables &loop) {
  if (loop.stop < loop.begin || loop.stop > loop.drive.size) return REFUSED;
  show(loop.base, loop.begin, loop.stop);
  show(loop.m0, loop.begin, loop.stop);
  for (int64_t n = loop.begin; n < loop.stop; n++) {
    loop.base_sum += loop.base.volts.at[n];
    loop.m0_sum += loop.m0.volts.at[n];
  }
  loop.steps_heard += double(loop.stop - loop.begin);
  loop.begin = loop.stop;
  return wants_attention(*loop.controller);
}

enum class LoopEnd : int64_t { COMPLETE, NEEDS_ATTENTION, MOTION_LOST };

// Advances sample by sample until the steps end, the motion fails, or the host must act.
inline int64_t close_loop(LoopCables &loop) {
  return with_shaker(*loop.shaker, [&](const auto &move) {
    while (loop.begin < loop.drive.size) {
      int64_t asked = play_loop(loop) - loop.begin, moved = move(loop.begin, loop.stop);
      if (moved < asked) {
        loop.begin += moved;
        return LoopEnd::MOTION_LOST;
      }
      if (hear_loop(loop)) return LoopEnd::NEEDS_ATTENTION;
    }
    return LoopEnd::COMPLETE;
  });
}

}  // namespace vibench
