// SPDX-License-Identifier: MIT
#include "scene.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <vector>

using namespace trephine_python;

namespace {

struct Batch {
  std::vector<ScenePointer> scenes;
};

Batch make_batch(std::vector<ScenePointer> scenes) {
  if (scenes.empty()) refuse("Batch", "scenes must not be empty", 0);
  std::set<const PythonBone*> bones;
  for (std::size_t s = 0; s < scenes.size(); ++s)
    if (!bones.insert(scenes[s]->bone.get()).second)
      refuse("Batch", "each scene must have a bone of its own (see Scene.copy); the bone is another scene's, in scene",
             s);
  return {std::move(scenes)};
}

/// Threads that each take the next scene and run all of its ticks.
class Crew {
 public:
  /// `tick(scene, stop)` runs one scene until it is done or `stop` is set; it must not throw.
  template <class Run>
  Crew(std::size_t threads, std::size_t scenes, const Run& run_scene) : left_(threads) {
    for (std::size_t t = 0; t < threads; ++t)
      threads_.emplace_back([this, scenes, &run_scene] {
        for (std::size_t s = next_++; s < scenes && !stop_; s = next_++) run_scene(s, stop_);
        const std::lock_guard lock(mutex_);
        if (--left_ == 0) done_.notify_all();
      });
  }
  ~Crew() {
    stop_ = true;
    for (std::thread& t : threads_) t.join();
  }
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  /// Waits for the end, or for so long; returns whether it is the end.
  bool wait_for(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return done_.wait_for(lock, time, [this] { return left_ == 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable done_;
  std::size_t left_;
  std::atomic<std::size_t> next_{0};
  std::atomic<bool> stop_{false};
  std::vector<std::thread> threads_;  // started last
};

py::dict run(const Batch& batch, const Numbers& poses, const py::object& spindle, const py::object& dt,
             std::optional<int> threads) {
  const char* const who = "Batch.run";
  if (threads && *threads < 1) refuse(who, "threads must be >= 1", *threads);
  const std::size_t count = batch.scenes.size();
  const auto most = static_cast<std::size_t>(threads.value_or(static_cast<int>(std::thread::hardware_concurrency())));
  std::vector<std::unique_ptr<Work<PythonBone>>> work;
  bool structures = false, law = false;
  for (const ScenePointer& s : batch.scenes) {
    work.push_back(std::make_unique<Work<PythonBone>>(s->bone));
    structures = structures || s->structures.has_value();
    law = law || s->scene.stages().law.has_value();
  }
  const Inputs inputs(who, static_cast<py::ssize_t>(count), poses, spindle, dt);
  Columns columns(inputs.shape(), structures, law);
  {
    const py::gil_scoped_release release;
    const auto run_scene = [&](std::size_t s, const std::atomic<bool>& stop) noexcept {
      compiled::Scene& scene = batch.scenes[s]->scene;
      for (std::size_t i = s * inputs.ticks(); i < (s + 1) * inputs.ticks() && !stop; ++i)
        columns.put(i, scene.tick(inputs.input(i), inputs.dt(i)));
    };
    Crew crew(std::clamp<std::size_t>(most, 1, count), count, run_scene);
    while (!crew.wait_for(std::chrono::milliseconds(50))) {
      const py::gil_scoped_acquire acquire;
      raise_signals();
    }
  }
  return columns.dict();
}

}  // namespace

void trephine_python::bind_batch(py::module_& m) {
  py::class_<Batch>(m, "Batch",
                    "Scenes that run together on all cores, each with a bone of its own.\n\n"
                    "Raises ValueError where two scenes share a bone.")
      .def(py::init(&make_batch), py::arg("scenes"))
      .def("run", &run, py::arg("poses"), py::arg("spindle") = true, py::arg("dt") = 1e-3,
           py::arg("threads") = py::none(),
           "Runs every scene as `Scene.run` does, and returns the same dict with arrays of (scenes, N, ...).\n\n"
           "`poses` is (scenes, N, 4, 4) or (scenes, N, 7); `spindle` and `dt` are one for all, or (scenes, N).\n"
           "`threads` is how many work; None: as many as the machine has. A thread at a time has a scene, so the\n"
           "results are the same bits for any number.")
      .def(py::pickle([](const Batch& b) { return py::make_tuple(b.scenes); },
                      [](const py::tuple& state) { return make_batch(state[0].cast<std::vector<ScenePointer>>()); }))
      .def("__len__", [](const Batch& b) { return b.scenes.size(); })
      .def_property_readonly(
          "scenes", [](const Batch& b) { return b.scenes; }, "the scenes");
}
