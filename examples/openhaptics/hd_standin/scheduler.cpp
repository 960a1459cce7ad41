// SPDX-License-Identifier: MIT
// The scheduler's and the error stack's functions of HD/hd.h.
#include "world.hpp"

#include <trephine/device/pacing.hpp>

#include <algorithm>
#include <chrono>

using hd_standin::At;
using hd_standin::Entry;
using hd_standin::World;

namespace {

HDSchedulerHandle schedule(World& w, HDSchedulerCallback callback, void* user, HDushort priority) {
  if (w.injected(At::kSchedule, nullptr)) return 0;
  if (w.entries.size() >= World::kMaxEntries) {
    w.push(HD_SCHEDULER_FULL);
    return 0;
  }
  const auto lower =
      std::find_if(w.entries.begin(), w.entries.end(), [&](const Entry& e) { return e.priority < priority; });
  return w.entries.insert(lower, {w.next_entry++, callback, user, priority})->handle;
}

bool is_scheduled(World& w, HDSchedulerHandle handle) {
  return std::any_of(w.entries.begin(), w.entries.end(), [&](const Entry& e) { return e.handle == handle && !e.done; });
}

}  // namespace

void hdStartScheduler(void) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (w.injected(At::kStartScheduler, nullptr)) return;
  if (w.opened.empty()) return w.push(HD_TIMER_ERROR);
  if (w.running) return w.push(HD_INVALID_OPERATION);
  w.running = true;
  // Takes the lock before it does anything, so its id is known when it does.
  w.thread = std::thread([&w] { w.serve(); });
  w.servo_thread = w.thread.get_id();
}

void hdStopScheduler(void) {
  World& w = World::get();
  std::thread thread;
  {
    const std::lock_guard lock(w.mutex);
    if (!w.running) return w.push(HD_INVALID_OPERATION);
    if (w.in_servo_thread()) return w.push(HD_INVALID_OPERATION);
    w.running = false;
    thread.swap(w.thread);
  }
  thread.join();
  const std::lock_guard lock(w.mutex);
  for (auto& d : w.opened) {
    (void)d.mechanics.write(trephine::Wrenchd::zero());
    d.witness.felt = d.mechanics.applied();
  }
}

void hdSetSchedulerRate(HDulong hertz) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (hertz < 100 || hertz > 10000) return w.push(HD_INVALID_VALUE);
  if (w.running) return w.push(HD_INVALID_OPERATION);
  w.rate = hertz;
}

HDdouble hdGetSchedulerTimeStamp(void) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  const auto now = trephine::ServoClock::now().time_since_epoch();
  return std::chrono::duration<double>(now).count() - w.tick_began;
}

HDSchedulerHandle hdScheduleAsynchronous(HDSchedulerCallback callback, void* user, HDushort priority) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  return schedule(w, callback, user, priority);
}

void hdScheduleSynchronous(HDSchedulerCallback callback, void* user, HDushort priority) {
  World& w = World::get();
  std::unique_lock lock(w.mutex);
  if (w.in_servo_thread() || !w.running) {
    while (callback(user) == HD_CALLBACK_CONTINUE) {
    }
    return;
  }
  const HDSchedulerHandle handle = schedule(w, callback, user, priority);
  w.ticked.wait(lock, [&] { return !is_scheduled(w, handle) || !w.running; });
}

void hdUnschedule(HDSchedulerHandle handle) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  const auto it =
      std::find_if(w.entries.begin(), w.entries.end(), [&](const Entry& e) { return e.handle == handle && !e.done; });
  if (it == w.entries.end()) return w.push(HD_INVALID_OPERATION);
  if (w.in_servo_thread())
    it->done = true;  // the list is being walked
  else
    w.entries.erase(it);
}

HDboolean hdWaitForCompletion(HDSchedulerHandle handle, HDWaitCode code) {
  World& w = World::get();
  std::unique_lock lock(w.mutex);
  if (code == HD_WAIT_INFINITE && w.running && !w.in_servo_thread())
    w.ticked.wait(lock, [&] { return !is_scheduled(w, handle) || !w.running; });
  return is_scheduled(w, handle) ? HD_TRUE : HD_FALSE;
}

HDErrorInfo hdGetError(void) {
  World& w = World::get();
  const std::lock_guard lock(w.mutex);
  if (w.errors.empty()) return {HD_SUCCESS, 0, HD_INVALID_HANDLE};
  const HDErrorInfo newest = w.errors.back();
  w.errors.pop_back();
  return newest;
}

HDstring hdGetErrorString(HDerror code) {
  switch (code) {
    case HD_SUCCESS:
      return "no error";
    case HD_INVALID_ENUM:
      return "unknown name";
    case HD_INVALID_VALUE:
      return "bad value";
    case HD_INVALID_OPERATION:
      return "not allowed now";
    case HD_INVALID_INPUT_TYPE:
      return "wrong type for this name";
    case HD_BAD_HANDLE:
      return "unknown handle";
    case HD_WARM_MOTORS:
      return "motors are warm";
    case HD_EXCEEDED_MAX_FORCE:
      return "maximum force exceeded";
    case HD_EXCEEDED_MAX_FORCE_IMPULSE:
      return "maximum force impulse exceeded";
    case HD_EXCEEDED_MAX_VELOCITY:
      return "maximum velocity exceeded";
    case HD_FORCE_ERROR:
      return "force error";
    case HD_DEVICE_FAULT:
      return "device fault";
    case HD_DEVICE_ALREADY_INITIATED:
      return "device is open";
    case HD_COMM_ERROR:
      return "communication error";
    case HD_COMM_CONFIG_ERROR:
      return "no such device";
    case HD_TIMER_ERROR:
      return "timer error";
    case HD_ILLEGAL_BEGIN:
      return "frame begun out of order";
    case HD_ILLEGAL_END:
      return "frame ended out of order";
    case HD_FRAME_ERROR:
      return "outside a frame";
    case HD_INVALID_PRIORITY:
      return "bad priority";
    case HD_SCHEDULER_FULL:
      return "scheduler full";
    case HD_INVALID_LICENSE:
      return "no licence";
    default:
      return "unknown error";
  }
}
