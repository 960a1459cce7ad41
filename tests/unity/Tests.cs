// SPDX-License-Identifier: MIT
// The binding's structs are those of the C header, field by field, and the haptic thread gives zero whenever it must.
//   mono unity_tests.exe trephine_c.h
using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.IO;
using System.Runtime.InteropServices;
using System.Text.RegularExpressions;
using System.Threading;
using Trephine;

static class Tests
{
    static int failures = 0;

    static void Check(bool holds, string what)
    {
        if (holds) return;
        Console.WriteLine("failed: " + what);
        ++failures;
    }

    static int Refusal(Action call)
    {
        try { call(); } catch (TrephineException e) { return e.Message.Length > 0 ? e.Code : -1; }
        return 0;
    }

    // ---- Layout: C's by its header and the rule of natural alignment ------------------------------------------------

    static readonly Dictionary<string, Type> structs = new Dictionary<string, Type> {
        { "pose", typeof(RigidPose) }, { "grid_options", typeof(GridOptions) }, { "tool", typeof(Tool) },
        { "scene_options", typeof(SceneOptions) }, { "tick_result", typeof(TickResult) },
        { "labels_options", typeof(LabelsOptions) }, { "structure_options", typeof(StructureOptions) },
        { "guard_options", typeof(GuardOptions) }, { "structure_totals", typeof(StructureTotals) } };
    // Size and alignment.
    static readonly Dictionary<string, int[]> types = new Dictionary<string, int[]> {
        { "uint8_t", new[] { 1, 1 } }, { "int32_t", new[] { 4, 4 } }, { "uint32_t", new[] { 4, 4 } },
        { "double", new[] { 8, 8 } }, { "const char*", new[] { IntPtr.Size, IntPtr.Size } } };

    static int Up(int offset, int alignment) { return (offset + alignment - 1) / alignment * alignment; }

    static void Layouts(string header)
    {
        string text = Regex.Replace(File.ReadAllText(header), @"/\*.*?\*/", "", RegexOptions.Singleline);
        int found = 0;
        foreach (Match body in Regex.Matches(text, @"typedef struct trephine_(\w+) \{(.*?)\} trephine_\1;", RegexOptions.Singleline))
        {
            string name = body.Groups[1].Value;
            Check(structs.ContainsKey(name), "there is a C# struct for " + name);
            if (!structs.ContainsKey(name)) continue;
            Type type = structs[name];
            int offset = 0, alignment = 1, fields = 0;
            foreach (Match line in Regex.Matches(body.Groups[2].Value, @"(const char\*|\w+)\s+([^;]+);"))
            {
                int[] one = types[line.Groups[1].Value];
                foreach (string declared in line.Groups[2].Value.Split(','))
                {
                    Match field = Regex.Match(declared.Trim(), @"^(\w+)(?:\[(\d+)\])?$");
                    int count = field.Groups[2].Success ? int.Parse(field.Groups[2].Value) : 1;
                    offset = Up(offset, one[1]);
                    string at = name + "." + field.Groups[1].Value;
                    var own = type.GetField(field.Groups[1].Value);
                    Check(own != null, at + " is there");
                    if (own == null) continue;
                    Check((int)Marshal.OffsetOf(type, own.Name) == offset, at + " lies at " + offset);
                    Type of = own.FieldType.IsEnum ? Enum.GetUnderlyingType(own.FieldType) : own.FieldType;
                    Check(Marshal.SizeOf(of) == count * one[0], at + " is as long");
                    bool real = line.Groups[1].Value == "double";
                    Check(real == (of == typeof(double) || of == typeof(Double3) || of == typeof(Double4)) || one[0] > 8, at + " is of its type");
                    offset += count * one[0];
                    alignment = Math.Max(alignment, one[1]);
                    ++fields;
                }
            }
            int size = Up(offset, alignment);
            Check(fields == type.GetFields(System.Reflection.BindingFlags.Public | System.Reflection.BindingFlags.Instance).Length, name + " has no more fields");
            Check(Marshal.SizeOf(type) == size, name + " has " + size + " bytes");
            types["trephine_" + name] = new[] { size, alignment };
            ++found;
        }
        Check(found == structs.Count, "all structs are found");
        foreach (Match m in Regex.Matches(text, @"TREPHINE_C_API [^(]*?(trephine_\w+)\("))
            Check(typeof(BoneGrid).Assembly.GetType("Trephine.Native").GetMember(m.Groups[1].Value, System.Reflection.BindingFlags.Static | System.Reflection.BindingFlags.NonPublic).Length > 0, m.Groups[1].Value + " is bound");
    }

    // The library's sizes: it takes no larger struct.
    static void Size<T>(Native.Init<T> init)
    {
        T o;
        ulong size = (ulong)Marshal.SizeOf(typeof(T));
        Check(init(out o, (UIntPtr)size) == 0 && init(out o, (UIntPtr)(size + 1)) == 3, typeof(T) + " has the library's size");
    }

    static void Defaults()
    {
        Size<GridOptions>(Native.trephine_grid_options_init);
        Size<SceneOptions>(Native.trephine_scene_options_init);
        Size<TickResult>(Native.trephine_tick_result_init);
        Size<LabelsOptions>(Native.trephine_labels_options_init);
        Size<StructureOptions>(Native.trephine_structure_options_init);
        Size<GuardOptions>(Native.trephine_guard_options_init);
        Size<StructureTotals>(Native.trephine_structure_totals_init);
        Check(SceneOptions.Default().cortical_density == 1700 && SceneOptions.Default().force_limit == 3.3, "defaults are read");
        Check(double.IsInfinity(TickResult.Default().distance) && TickResult.Default().X_WV.rotation.w == 1, "so are a result's");
    }

    // ---- Handles and errors -----------------------------------------------------------------------------------------

    const int Side = 32;
    const double Spacing = 0.5e-3, Top = 15.409e-3 / 2;

    static BoneGrid MakeGrid()
    {
        var voxels = new short[Side * Side * Side];
        for (int i = 0; i < voxels.Length; ++i) voxels[i] = (short)(i < voxels.Length / 2 ? 1200 : -1000);
        GridOptions o = GridOptions.Default();
        o.size = new Int3(Side, Side, Side);
        o.spacing = new Double3(Spacing, Spacing, Spacing);
        return BoneGrid.Create(o, voxels);
    }

    static DrillScene MakeScene(BoneGrid grid, string tool = null)
    {
        SceneOptions o = SceneOptions.Default();
        o.algorithm = Algorithm.Coupled;
        o.isovalue = 300;
        return DrillScene.Create(grid, o, tool);
    }

    static void Handles()
    {
        BoneGrid grid = MakeGrid();
        Check(Refusal(() => MakeScene(grid, "spoon-3")) == 2, "a tool that is none is refused by a message");
        DrillScene scene = MakeScene(grid, "match-head-3");
        var labels = new byte[Side * Side * Side];
        for (int i = 0; i < labels.Length / 4; ++i) labels[i] = 1;
        LabelsOptions l = LabelsOptions.Default();
        l.size = new Int3(Side, Side, Side);
        l.spacing = new Double3(Spacing, Spacing, Spacing);
        using (BoneStructures s = BoneStructures.Create(l, labels))
        {
            s.SetName(0, "dura");
            Check(s.Count == 1 && s.Name(0) == "dura", "structures have names");
            s.Set(0, StructureOptions.Default());
            s.SetGuard(GuardOptions.Default());
            using (Protection p = Protection.Create(scene, s)) scene.Exchange(p);
            scene.SetStructures(null);
        }
        grid.Dispose();  // the scene keeps the bone
        TickResult r = TickResult.Default();
        var X_WT = new RigidPose(new Double3(8e-3, 8e-3, 12e-3), new Double4(0, 0, 0, 1));
        scene.Tick(ref X_WT, false, 1e-3, ref r);
        Check(r.status == Status.Ok, "a scene outlives its grid's handle");
        scene.Dispose();
        bool thrown = false;
        try { scene.Reset(); } catch (ObjectDisposedException) { thrown = true; }
        Check(thrown, "a disposed handle reaches no C");
    }

    // ---- The haptic thread ------------------------------------------------------------------------------------------

    static RigidPose At(double height) { return new RigidPose(new Double3(8e-3, 8e-3, height), new Double4(0, 0, 0, 1)); }

    // Exchanges until the condition holds, half a minute at most, for machines that do much else.
    static HapticState Until(HapticThread haptics, RigidPose X_WT, Func<HapticState, bool> condition, string what)
    {
        Stopwatch clock = Stopwatch.StartNew();
        for (;;)
        {
            HapticState s = haptics.Exchange(X_WT, false);
            if (condition(s)) return s;
            if (clock.Elapsed.TotalSeconds > 30) { Check(false, what); return s; }
            Thread.Sleep(1);
        }
    }

    // Comes down to 0.5 mm deep, and waits for the whole force.
    static HapticState Press(HapticThread haptics, out RigidPose pressed)
    {
        for (double d = -1e-3; d < 0.5e-3; d += 2e-5) Until(haptics, At(Top + 1.5e-3 - d), s => s.live, "poses are answered");
        RigidPose X_WT = pressed = At(Top + 1e-3);
        return Until(haptics, X_WT, s => s.force.z > 0.35, "bone is felt");
    }

    static void Silence()
    {
        using (BoneGrid grid = MakeGrid())
        using (DrillScene scene = MakeScene(grid))
        using (var haptics = new HapticThread(scene, false))
        {
            Check(!haptics.Exchange(At(0.02), false).live, "before the start there is zero");
            haptics.Start();
            RigidPose X_WT;
            double full = Press(haptics, out X_WT).force.z;
            Check(full < 0.5, "the spring's force");

            // The host's last word is 11 ms old at least: whoever reads, and whoever comes back, gets zero.
            Thread.Sleep(11);
            HapticState s = haptics.Read();
            Check(!s.live && s.force.Length == 0 && s.torque.Length == 0, "a silent host's wrench is zero");
            long ticks = s.ticks;
            Thread.Sleep(50);
            Check(haptics.Read().ticks <= ticks + 12, "nothing is ticked while the host is silent");
            Stopwatch clock = Stopwatch.StartNew();
            s = haptics.Exchange(X_WT, false);
            Check(!s.live && s.force.Length == 0, "the first wrench after a silence is zero");
            while (clock.Elapsed.TotalSeconds < 0.05)
            {
                s = haptics.Exchange(X_WT, false);
                // A tick's interval may have begun before the clock.
                double most = full * 1.05 * (clock.Elapsed.TotalSeconds + 0.011) / 0.1;
                Check(s.force.Length <= most, "the wrench comes back by a ramp, " + s.force.z + " N of " + most);
                Thread.Sleep(1);
            }
            Until(haptics, X_WT, r => r.force.z > 0.35, "it comes back");

            RigidPose bad = X_WT;
            bad.position.y = double.NaN;
            s = Until(haptics, bad, r => r.status == Status.BadInput, "a bad pose has its status");
            Check(s.force.Length == 0, "and no wrench");
            Until(haptics, X_WT, r => r.force.z > 0.35, "the next good one recovers");

            haptics.Stop();
            s = haptics.Exchange(X_WT, false);
            Check(!s.live && s.force.Length == 0 && haptics.Error == null, "a stopped thread gives zero");
        }
    }

    // A thread that seldom looks has not seen the silence yet: whoever asks judges it by the clock.
    static void SeenByTheAsker()
    {
        using (BoneGrid grid = MakeGrid())
        using (DrillScene scene = MakeScene(grid))
        using (var haptics = new HapticThread(scene, false, 100, 0.0105, 0.02))
        {
            haptics.Start();
            RigidPose X_WT;
            Press(haptics, out X_WT);
            for (int round = 0; round < 10; ++round)
            {
                Until(haptics, X_WT, r => r.force.z > 0.35, "bone is felt");
                Stopwatch clock = Stopwatch.StartNew();
                while (clock.Elapsed.TotalSeconds < 0.011) Thread.Sleep(0);
                HapticState s = round % 2 == 0 ? haptics.Read() : haptics.Exchange(X_WT, false);
                Check(!s.live && s.force.Length == 0, "zero in round " + round);
            }
        }
    }

    static void Faults()
    {
        using (BoneGrid grid = MakeGrid())
        using (var haptics = new HapticThread(MakeScene(grid), true))
        {
            haptics.Start();
            DrillScene scene = (DrillScene)typeof(HapticThread).GetField("scene", System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic).GetValue(haptics);
            Until(haptics, Mirror.Pose(At(0.02)), s => s.live, "poses are answered");
            scene.Dispose();
            HapticState end = Until(haptics, Mirror.Pose(At(0.02)), s => haptics.Error != null, "the thread ends by an exception");
            Check(haptics.Error is ObjectDisposedException && !haptics.Read().live && end.force.Length == 0, "and gives zero");
        }
    }

    static int Main(string[] args)
    {
        Layouts(args[0]);
        Defaults();
        Handles();
        Silence();
        SeenByTheAsker();
        Faults();
        Console.WriteLine(failures == 0 ? "the binding works" : failures + " checks failed");
        return failures == 0 ? 0 : 1;
    }
}
