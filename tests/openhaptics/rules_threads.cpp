// SPDX-License-Identifier: MIT
// The stand-in keeps the interface's rules: each is broken on purpose and must be noticed.
#include "openhaptics/fixture.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <array>
#include <limits>

namespace {

using namespace trephine::test;
using Codes = std::vector<HDerror>;

/// An opened and running device, driven through the interface alone.
struct Running {
  HHD device;
  explicit Running(hd_standin::Model model = rigid()) {
    hd_standin::plug({model});
    device = hdInitDevice(HD_DEFAULT_DEVICE);
    hdMakeCurrentDevice(device);
    hdEnable(HD_FORCE_OUTPUT);
    hdStartScheduler();
  }
  ~Running() {
    hdStopScheduler();
    hdDisableDevice(device);
    (void)popped();
  }
};

/// A whole frame.
void frame(HHD device, const std::array<double, 3>& force_N = {}) {
  hdBeginFrame(device);
  hdSetDoublev(HD_CURRENT_FORCE, force_N.data());
  hdEndFrame(device);
}

}  // namespace

TEST_CASE("stand-in: a frame by the rules is no error, and its force is felt") {
  Running r;
  CHECK(popped().empty());
  in_servo_thread([&] { frame(r.device, {0, 2, 0}); });
  CHECK(hd_standin::witness("Default Device").felt.force.y() == 2);
  CHECK(popped().empty());
  in_servo_thread([&] { frame(r.device); });
  CHECK(hd_standin::witness("Default Device").felt.force.y() == 0);
  // Force and torque are zero from the beginning of a frame.
  std::array<double, 3> read{9, 9, 9};
  in_servo_thread([&] { frame(r.device, {0, 2, 0}); });
  in_servo_thread([&] {
    hdBeginFrame(r.device);
    hdGetDoublev(HD_CURRENT_FORCE, read.data());
    hdEndFrame(r.device);
  });
  CHECK(read == std::array<double, 3>{0, 0, 0});
  CHECK(hd_standin::witness("Default Device").felt.force.y() == 0);
  CHECK(hd_standin::errors().empty());
}

TEST_CASE("stand-in: frames out of order") {
  Running r;
  in_servo_thread([&] {
    hdBeginFrame(r.device);
    hdBeginFrame(r.device);
    hdEndFrame(r.device);
  });
  CHECK(popped() == Codes{HD_ILLEGAL_BEGIN});
  in_servo_thread([&] {  // a second frame in one tick
    frame(r.device);
    hdBeginFrame(r.device);
  });
  CHECK(popped() == Codes{HD_ILLEGAL_BEGIN});
  in_servo_thread([&] { hdEndFrame(r.device); });
  CHECK(popped() == Codes{HD_ILLEGAL_END});
  hdBeginFrame(r.device);  // not in the servo thread
  CHECK(popped() == Codes{HD_ILLEGAL_BEGIN});
  in_servo_thread([&] { hdBeginFrame(r.device); });  // left open
  in_servo_thread([] {});
  CHECK(popped() == Codes{HD_FRAME_ERROR});
  in_servo_thread([&] { hdBeginFrame(r.device + 7); });
  CHECK(popped() == Codes{HD_BAD_HANDLE});
}

TEST_CASE("stand-in: setting outside a frame, the wrong thing or the wrong way") {
  Running r(rigid("Default Device", 3));
  const std::array<double, 3> v{1, 0, 0};
  const std::array<double, 3> bad{std::numeric_limits<double>::quiet_NaN(), 0, 0};
  const std::array<int, 3> whole{1, 0, 0};
  in_servo_thread([&] { hdSetDoublev(HD_CURRENT_FORCE, v.data()); });
  CHECK(popped() == Codes{HD_FRAME_ERROR});
  hdSetDoublev(HD_CURRENT_FORCE, v.data());
  CHECK(popped() == Codes{HD_FRAME_ERROR});
  const auto in_frame = [&](auto f) {
    in_servo_thread([&] {
      hdBeginFrame(r.device);
      f();
      hdEndFrame(r.device);
    });
    return popped();
  };
  CHECK(in_frame([&] { hdSetDoublev(HD_CURRENT_POSITION, v.data()); }) == Codes{HD_INVALID_ENUM});
  CHECK(in_frame([&] { hdSetIntegerv(HD_CURRENT_FORCE, whole.data()); }) == Codes{HD_INVALID_INPUT_TYPE});
  CHECK(in_frame([&] { hdSetDoublev(HD_CURRENT_TORQUE, v.data()); }) == Codes{HD_INVALID_OPERATION});
  CHECK(in_frame([&] { hdSetDoublev(HD_CURRENT_FORCE, bad.data()); }) == Codes{HD_INVALID_VALUE});
  CHECK(hd_standin::witness("Default Device").felt.force.norm() == 0);
}

TEST_CASE("stand-in: getting what there is not, or as the wrong type; outside a frame the last one's values") {
  hd_standin::Model model = rigid();
  model.mechanics.X_DH = trephine::Posed(Eigen::Translation3d(0.01, 0.02, -0.03));
  Running r(model);
  std::array<double, 16> d{};
  int i = 0;
  hdGetDoublev(0x2999, d.data());
  CHECK(popped() == Codes{HD_INVALID_ENUM});
  hdGetDoublev(HD_CURRENT_BUTTONS, d.data());
  CHECK(popped() == Codes{HD_INVALID_INPUT_TYPE});
  hdGetIntegerv(HD_CURRENT_POSITION, &i);
  CHECK(popped() == Codes{HD_INVALID_INPUT_TYPE});
  hdGetDoublev(HD_CURRENT_POSITION, d.data());
  CHECK(popped().empty());
  CHECK(d[0] == near(10));
  CHECK(d[1] == near(20));
  CHECK(d[2] == near(-30));
  hdEnable(HD_CURRENT_FORCE);
  CHECK(popped() == Codes{HD_INVALID_ENUM});
}

TEST_CASE("stand-in: errors come newest first, with their device") {
  Running r;
  hd_standin::inject({.code = HD_WARM_MOTORS, .at = hd_standin::At::kBeginFrame});
  hd_standin::inject({.code = HD_COMM_ERROR, .at = hd_standin::At::kEndFrame});
  in_servo_thread([&] { frame(r.device); });
  const HDErrorInfo first = hdGetError();
  CHECK(first.errorCode == HD_COMM_ERROR);
  CHECK(first.hHD == r.device);
  CHECK(hdGetError().errorCode == HD_WARM_MOTORS);
  CHECK(hdGetError().errorCode == HD_SUCCESS);
}

TEST_CASE("stand-in: too much force trips, and the motors stay without power for a while") {
  hd_standin::Model model = rigid();
  model.trip_time = 0.3;  // a stall of the machine is at most 0.1 s of the model's time
  Running r(model);
  in_servo_thread([&] { frame(r.device, {0, 0, 3.31}); });
  CHECK(popped() == Codes{HD_EXCEEDED_MAX_FORCE});
  CHECK(hd_standin::witness("Default Device").felt.force.norm() == 0);
  in_servo_thread([&] { frame(r.device, {0, 0, 1}); });
  CHECK(popped().empty());
  CHECK(hd_standin::witness("Default Device").felt.force.norm() == 0);
  while (!hd_standin::witness("Default Device").powered) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  in_servo_thread([&] { frame(r.device, {0, 0, 3.3}); });
  CHECK(popped().empty());
  CHECK(hd_standin::witness("Default Device").felt.force.z() == 3.3);
}

TEST_CASE("stand-in: no force unless it is enabled, none when the scheduler has stopped") {
  hd_standin::plug({rigid()});
  const HHD device = hdInitDevice(HD_DEFAULT_DEVICE);
  hdStartScheduler();
  in_servo_thread([&] { frame(device, {1, 0, 0}); });
  CHECK(hd_standin::witness("Default Device").felt.force.norm() == 0);
  hdEnable(HD_FORCE_OUTPUT);
  CHECK(hdIsEnabled(HD_FORCE_OUTPUT) == HD_TRUE);
  in_servo_thread([&] { frame(device, {1, 0, 0}); });
  CHECK(hd_standin::witness("Default Device").felt.force.norm() == 1);
  hdStopScheduler();
  CHECK(hd_standin::witness("Default Device").felt.force.norm() == 0);
  hdDisableDevice(device);
  CHECK(popped().empty());
}

TEST_CASE("stand-in: the scheduler's own rules") {
  hd_standin::plug({rigid()});
  hdStartScheduler();
  CHECK(popped() == Codes{HD_TIMER_ERROR});  // no device
  const HHD device = hdInitDevice("Default Device");
  CHECK(hdInitDevice("Default Device") == HD_INVALID_HANDLE);
  CHECK(popped() == Codes{HD_DEVICE_ALREADY_INITIATED});
  CHECK(hdInitDevice("Nobody") == HD_INVALID_HANDLE);
  CHECK(popped() == Codes{HD_COMM_CONFIG_ERROR});
  hdStopScheduler();
  CHECK(popped() == Codes{HD_INVALID_OPERATION});
  hdSetSchedulerRate(5);
  CHECK(popped() == Codes{HD_INVALID_VALUE});
  hdStartScheduler();
  hdStartScheduler();
  CHECK(popped() == Codes{HD_INVALID_OPERATION});

  // Higher priority first, each until it is done; then its handle is worth nothing.
  struct Note {
    std::vector<int>* order;
    int id;
    int times;
  };
  std::vector<int> order;
  Note low{&order, 1, 3}, high{&order, 2, 2};
  const auto note = [](void* user) -> HDCallbackCode {
    Note& n = *static_cast<Note*>(user);
    n.order->push_back(n.id);
    return --n.times > 0 ? HD_CALLBACK_CONTINUE : HD_CALLBACK_DONE;
  };
  HDSchedulerHandle handle_low = 0;
  in_servo_thread([&] {
    handle_low = hdScheduleAsynchronous(note, &low, 10);
    hdScheduleAsynchronous(note, &high, HD_MAX_SCHEDULER_PRIORITY);
  });
  CHECK(hdWaitForCompletion(handle_low, HD_WAIT_INFINITE) == HD_FALSE);
  CHECK(order == std::vector<int>{1, 2, 1, 2, 1});  // the first 1: still in the tick that scheduled it
  hdUnschedule(handle_low);
  CHECK(popped() == Codes{HD_INVALID_OPERATION});

  const auto forever = [](void*) -> HDCallbackCode { return HD_CALLBACK_CONTINUE; };
  std::vector<HDSchedulerHandle> handles;
  for (int i = 0; i < 17; ++i) handles.push_back(hdScheduleAsynchronous(forever, nullptr, 1));
  CHECK(popped() == Codes{HD_SCHEDULER_FULL});
  CHECK(hdWaitForCompletion(handles[0], HD_WAIT_CHECK_STATUS) == HD_TRUE);
  for (int i = 0; i < 16; ++i) hdUnschedule(handles[static_cast<std::size_t>(i)]);
  CHECK(hd_standin::scheduled() == 0);
  double stamp = -1;
  in_servo_thread([&] { stamp = hdGetSchedulerTimeStamp(); });
  CHECK(stamp >= 0);
  CHECK(stamp < 1);
  hdStopScheduler();
  hdDisableDevice(device);
  hdDisableDevice(device);
  CHECK(popped() == Codes{HD_BAD_HANDLE});
}

TEST_CASE("stand-in: three degrees of freedom know no torque, and no limit of it") {
  Running r(rigid("Default Device", 3));
  int dof = 0;
  double limit = -1;
  hdGetIntegerv(HD_OUTPUT_DOF, &dof);
  CHECK(dof == 3);
  hdGetDoublev(HD_NOMINAL_MAX_TORQUE_FORCE, &limit);
  CHECK(popped() == Codes{HD_INVALID_ENUM});
  CHECK(limit == -1);
}

TEST_CASE("stand-in: devices cannot be replaced in use") {
  Running r;
  CHECK_THROWS_AS(hd_standin::plug({rigid()}), std::logic_error);
}
