// SPDX-License-Identifier: MIT
using System;
using System.Diagnostics;
using System.Threading;

namespace Trephine
{
    // What the haptic thread last found. Force and torque are zero unless `live`.
    public struct HapticState
    {
        public bool live;              // the wrench is of a pose and a tick that are both younger than the silence
        public Double3 force, torque;  // on the tool, about the burr's centre; ramped [N, N m]
        public RigidPose drawn;        // where to draw the tool
        public Status status;
        public double removed_mm3;  // since the scene was made
        public long ticks, late;    // late: began over a period after it was due
    }

    // Ticks a scene on a thread of its own. Any thread may exchange poses for states, and holds a lock for some
    // nanoseconds only. Whatever drives motors calls Exchange itself, a thousand times a second.
    //
    // The wrench is zero before the first pose, after Stop, after an exception (see Error), and where the host has been
    // silent for 10 ms or the thread has. It then comes back by a ramp. All this is judged in Exchange and Read as well,
    // by the clock, so that it holds even where the thread hangs.
    //
    // While the host is silent nothing is ticked and nothing is milled. The scene, and the pose of its bone, belong to
    // this thread while it runs.
    public sealed class HapticThread : IDisposable
    {
        readonly DrillScene scene;
        readonly bool leftHanded;
        readonly long period, silence;
        readonly double rampTime;
        readonly Thread thread;
        readonly object gate = new object();
        // Under the gate. Times are Stopwatch's; 0: none.
        RigidPose pose;
        bool spindle, stopped = true;
        bool letGo = true;  // a zero was given where a wrench would have acted: the next one rises from there
        long poseTime, stateTime;
        HapticState state;
        Exception error;

        // With `leftHanded` poses come and states go in axes whose z is mirrored.
        public HapticThread(DrillScene scene, bool leftHanded, double rate = 1000, double silence = 0.010, double ramp = 0.1)
        {
            if (!(rate >= 100 && rate <= 20000)) throw new ArgumentOutOfRangeException("rate");
            if (!(silence > 1 / rate && silence <= 1)) throw new ArgumentOutOfRangeException("silence");
            this.scene = scene;
            this.leftHanded = leftHanded;
            this.silence = (long)(silence * Stopwatch.Frequency);
            period = (long)(Stopwatch.Frequency / rate);
            rampTime = ramp;
            thread = new Thread(Run) { IsBackground = true, Name = "haptic", Priority = ThreadPriority.Highest };
        }

        // Once.
        public void Start()
        {
            lock (gate) stopped = false;
            thread.Start();
        }

        // From here on every wrench is zero, whether or not the thread has ended within the second.
        public void Stop()
        {
            lock (gate) stopped = true;
            if (thread.IsAlive) thread.Join(1000);
        }
        public void Dispose() { Stop(); }

        // What ended the thread; null while it runs.
        public Exception Error { get { lock (gate) return error; } }

        // Gives the tool's pose and takes the latest wrench.
        public HapticState Exchange(RigidPose X_WT, bool spindle)
        {
            lock (gate)
            {
                long now = Stopwatch.GetTimestamp();
                if (now - poseTime > silence) letGo = true;
                pose = X_WT;
                this.spindle = spindle;
                poseTime = now;
                return Fresh(now);
            }
        }

        // For drawing: no pose is given.
        public HapticState Read() { lock (gate) return Fresh(Stopwatch.GetTimestamp()); }

        HapticState Fresh(long now)
        {
            HapticState s = state;
            if (s.live && (stopped || now - poseTime > silence || now - stateTime > silence)) letGo = true;
            s.live = s.live && !letGo;
            if (!s.live) s.force = s.torque = new Double3();
            return s;
        }

        void Run()
        {
            try
            {
                using (ForceRamp ramp = ForceRamp.Create(rampTime)) Loop(ramp);
            }
            catch (Exception e)
            {
                lock (gate) error = e;
            }
            finally
            {
                lock (gate) stopped = true;
            }
        }

        void Loop(ForceRamp ramp)
        {
            TickResult result = TickResult.Default();
            HapticState next = new HapticState();
            long last = Stopwatch.GetTimestamp(), due = last;
            for (;;)
            {
                WaitUntil(due);
                long now = Stopwatch.GetTimestamp();
                double dt = (double)(now - last) / Stopwatch.Frequency;
                last = now;
                if (now - due > period)
                {
                    ++next.late;
                    due = now;
                }
                due += period;

                RigidPose X;
                bool on, anew, silent;
                lock (gate)
                {
                    if (stopped) return;
                    X = pose;
                    on = spindle;
                    silent = now - poseTime > silence;
                    anew = letGo || silent;
                    letGo = false;
                    if (anew) state.live = false;  // what was found before may not act while this tick is found
                }
                if (anew) ramp.Restart();
                next.live = !silent;
                if (!silent)
                {
                    if (leftHanded) X = Mirror.Pose(X);
                    scene.Tick(ref X, on, dt, ref result);
                    double factor = ramp.Step(scene, result.status, dt);
                    next.force = factor * (leftHanded ? Mirror.Force(result.force) : result.force);
                    next.torque = factor * (leftHanded ? Mirror.Torque(result.torque) : result.torque);
                    next.drawn = leftHanded ? Mirror.Pose(result.X_WV) : result.X_WV;
                    next.status = result.status;
                    next.removed_mm3 = result.removed_total_mm3;
                    ++next.ticks;
                }
                lock (gate)
                {
                    state = next;
                    stateTime = Stopwatch.GetTimestamp();
                }
            }
        }

        // Windows' Sleep may take 16 ms: there a core is kept busy instead.
        static readonly bool sleeps = Environment.OSVersion.Platform != PlatformID.Win32NT;
        static void WaitUntil(long due)
        {
            for (;;)
            {
                long left = due - Stopwatch.GetTimestamp();
                if (left <= 0) return;
                Thread.Sleep(sleeps && left > Stopwatch.Frequency / 2000 ? 1 : 0);
            }
        }
    }
}
