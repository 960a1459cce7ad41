// SPDX-License-Identifier: MIT
#pragma once

/// Sessions: recordings, logs that outlive a killed process, and scores of training.
#include <trephine/session/bone_over.hpp>
#include <trephine/session/cavity_scores.hpp>
#include <trephine/session/followed_bone.hpp>
#include <trephine/session/recorder.hpp>
#include <trephine/session/recording_file.hpp>
#include <trephine/session/scores.hpp>
#include <trephine/session/session_file.hpp>
#include <trephine/session/session_log.hpp>
