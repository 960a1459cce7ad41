// SPDX-License-Identifier: MIT
// Drills a block of bone from a console, as a host with left-handed axes does it, and checks what comes.
//   mono unity_drill.exe [SECONDS]   longest time it may take; 0 where all is as it should be
using System;
using System.Diagnostics;
using System.Threading;
using Trephine;

static class Program
{
    const int Side = 48;
    const double Spacing = 0.5e-3, Isovalue = 300;
    static int failures = 0;

    static void Check(bool holds, string what)
    {
        if (holds) return;
        Console.WriteLine("failed: " + what);
        ++failures;
    }

    static bool Finite(Double3 v)
    {
        return !double.IsNaN(v.x + v.y + v.z) && !double.IsInfinity(v.x + v.y + v.z);
    }

    // Bone below half the height; y is up, as in Unity.
    static BoneGrid MakeBone()
    {
        var voxels = new short[Side * Side * Side];
        for (int i = 0; i < voxels.Length; ++i) voxels[i] = (short)(i / Side % Side < Side / 2 ? 1200 : -1000);
        GridOptions o = GridOptions.Default();
        o.size = new Int3(Side, Side, Side);
        o.spacing = new Double3(Spacing, Spacing, Spacing);
        return BoneGrid.Create(o, voxels);
    }

    // Volume under the bone's surface [mm3], of what is drawn: brick by brick, as the meshes have it.
    static double Volume(BrickMesh m)
    {
        double sum = 0;
        for (int i = 0; i < m.indexCount; i += 3)
        {
            uint a = 3 * m.indices[i], b = 3 * m.indices[i + 1], c = 3 * m.indices[i + 2];
            float[] p = m.positions;
            sum += p[a] * (p[b + 1] * p[c + 2] - p[b + 2] * p[c + 1]) + p[a + 1] * (p[b + 2] * p[c] - p[b] * p[c + 2])
                 + p[a + 2] * (p[b] * p[c + 1] - p[b + 1] * p[c]);
        }
        return 1e9 * sum / 6;
    }

    static int Main(string[] args)
    {
        double longest = args.Length > 0 ? double.Parse(args[0], System.Globalization.CultureInfo.InvariantCulture) : 60;
        SceneOptions options = SceneOptions.Default();
        options.algorithm = Algorithm.Coupled;
        options.isovalue = Isovalue;
        options.tool.tip_radius = 1.5e-3;
        using (BoneGrid grid = MakeBone())
        using (DrillScene scene = DrillScene.Create(grid, options))
        using (var mesh = new BoneMesh(grid, Isovalue))
        using (var haptics = new HapticThread(scene, true))
        {
            var volumes = new double[6 * 6 * 6];
            Action<BrickMesh> draw = m => volumes[m.brick] = Volume(m);
            int all = mesh.Update(int.MaxValue, draw), anew = 0, steps = 0, live = 0;
            double before = 0, after = 0, greatest = 0;  // mm3, mm3, N
            foreach (double v in volumes) before += v;

            // Straight down; in left-handed axes a quarter turn about x has the tool's z, which is its tip's way, down.
            double middle = Side / 2 * Spacing, half = Math.Sqrt(0.5);
            var X_WT = new RigidPose(new Double3(middle, middle + 2e-3, -middle), new Double4(half, 0, 0, half));
            HapticState s = new HapticState();
            Stopwatch clock = Stopwatch.StartNew();
            haptics.Start();
            while (s.removed_mm3 < 10 && clock.Elapsed.TotalSeconds < longest && haptics.Error == null)
            {
                s = haptics.Exchange(X_WT, greatest > 0.2);  // presses first, and drills when bone is felt
                Check(Finite(s.force) && Finite(s.torque), "the wrench is finite");
                greatest = Math.Max(greatest, s.force.y);
                if (s.live) ++live;
                if (s.live && X_WT.position.y > middle - 2e-3) X_WT.position.y -= 4e-6;
                if (++steps % 16 == 0) anew += mesh.Update(64, draw);
                Thread.Sleep(1);
            }
            double seconds = clock.Elapsed.TotalSeconds;
            haptics.Stop();
            s = haptics.Read();
            anew += mesh.Update(int.MaxValue, draw);
            foreach (double v in volumes) after += v;

            Check(haptics.Error == null, "the haptic thread runs: " + haptics.Error);
            Check(all == 216, "every brick is drawn at first");
            Check(anew > 0, "bricks that are drilled are drawn anew");
            Check(s.removed_mm3 >= 10, "bone is removed");
            // The mesh has no smaller part of the hole than its chords leave out.
            Check(Math.Abs(before - after - s.removed_mm3) < 0.1 * s.removed_mm3, "the mesh has the hole");
            Check(greatest > 0.2 && greatest < 3.4, "bone presses the tool up");
            Check(!s.live && s.force.Length == 0, "a stopped thread gives zero");
            Console.WriteLine("{0} bricks, {1} drawn anew; {2:F1} mm3 removed, {3:F1} mm3 gone from the mesh; {4:F2} N; "
                + "{5} ticks in {6:F1} s, {7} late; {8} of {9} exchanges live",
                all, anew, s.removed_mm3, before - after, greatest, s.ticks, seconds, s.late, live, steps);
        }
        Console.WriteLine(failures == 0 ? "drilled" : failures + " checks failed");
        return failures == 0 ? 0 : 1;
    }
}
