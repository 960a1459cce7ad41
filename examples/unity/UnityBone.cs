// SPDX-License-Identifier: MIT
#if UNITY_5_3_OR_NEWER
using System;
using System.Collections.Generic;
using Trephine;
using UnityEngine;
using UnityEngine.Rendering;

// Bone in a scene of Unity (2019.3 or newer): draws it, and drills it by `tool`, whose forward axis is the way of its tip.
// Lengths are metres. The bone stands where this object does when it is enabled; its scale must be 1.
public sealed class UnityBone : MonoBehaviour
{
    public TextAsset voxels;  // a .bytes file of int16 Hounsfield units, x fastest; none: a block of bone
    public Vector3Int size = new Vector3Int(64, 64, 64);
    public Vector3 spacing = new Vector3(0.0005f, 0.0005f, 0.0005f);
    public float isovalue = 300, burrRadius = 0.0015f;
    public Material material;
    public int bricksPerFrame = 64;
    public Transform tool;    // gives poses, unless a device does
    public Transform drawn;   // is put where the bone holds the tool; may be null
    public bool spindle;
    // True: a device's thread calls Haptics.Exchange at 1 kHz, and silence of 10 ms ends its force. False: poses come from
    // Update, 60 times a second at best, which is for mouse and controllers. Let such forces move no motors.
    public bool deviceGivesPoses;

    public HapticThread Haptics { get; private set; }
    public HapticState State { get; private set; }

    BoneGrid grid;
    DrillScene scene;
    BoneMesh mesh;
    Action<BrickMesh> show;
    readonly Dictionary<int, Mesh> meshes = new Dictionary<int, Mesh>();
    readonly List<GameObject> bricks = new List<GameObject>();

    void OnEnable()
    {
        show = Show;
        GridOptions g = GridOptions.Default();
        g.size = new Int3(size.x, size.y, size.z);
        g.spacing = new Double3(spacing.x, spacing.y, spacing.z);
        g.X_WG = Mirror.Pose(PoseOf(transform));
        grid = BoneGrid.Create(g, Voxels());
        SceneOptions o = SceneOptions.Default();
        o.algorithm = Algorithm.Coupled;
        o.isovalue = isovalue;
        o.tool.tip_radius = burrRadius;
        scene = DrillScene.Create(grid, o);
        mesh = new BoneMesh(grid, isovalue);
        Haptics = new HapticThread(scene, true, 1000, deviceGivesPoses ? 0.010 : 0.25);
        Haptics.Start();
    }

    void Update()
    {
        if (Haptics == null || (tool == null && !deviceGivesPoses)) return;
        State = deviceGivesPoses ? Haptics.Read() : Haptics.Exchange(PoseOf(tool), spindle);
        mesh.Update(bricksPerFrame, show);
        if (drawn != null && State.live)
        {
            Double3 p = State.drawn.position;
            Double4 q = State.drawn.rotation;
            drawn.SetPositionAndRotation(new Vector3((float)p.x, (float)p.y, (float)p.z),
                                         new Quaternion((float)q.x, (float)q.y, (float)q.z, (float)q.w));
        }
        if (Haptics.Error == null) return;
        Debug.LogError("The haptic thread ended: " + Haptics.Error.Message);
        enabled = false;
    }

    // Also before scripts are loaded anew, so no thread outlives them.
    void OnDisable()
    {
        if (Haptics != null) Haptics.Dispose();
        if (mesh != null) mesh.Dispose();
        if (scene != null) scene.Dispose();
        if (grid != null) grid.Dispose();
        foreach (Mesh m in meshes.Values) Destroy(m);
        foreach (GameObject brick in bricks) Destroy(brick);
        meshes.Clear();
        bricks.Clear();
        Haptics = null;
    }

    static RigidPose PoseOf(Transform t)
    {
        Vector3 p = t.position;
        Quaternion q = t.rotation;
        return new RigidPose(new Double3(p.x, p.y, p.z), new Double4(q.x, q.y, q.z, q.w));
    }

    short[] Voxels()
    {
        var all = new short[size.x * size.y * size.z];
        if (voxels == null)
        {
            for (int i = 0; i < all.Length; ++i) all[i] = (short)(i / size.x % size.y < size.y / 2 ? 1200 : -1000);
            return all;
        }
        byte[] bytes = voxels.bytes;
        if (bytes.Length != 2 * all.Length) throw new ArgumentException("voxels has " + bytes.Length + " bytes, not two a voxel");
        Buffer.BlockCopy(bytes, 0, all, 0, bytes.Length);
        return all;
    }

    void Show(BrickMesh b)
    {
        Mesh m;
        if (!meshes.TryGetValue(b.brick, out m))
        {
            if (b.vertexCount == 0) return;
            var child = new GameObject("brick " + b.brick);
            child.transform.SetParent(transform, false);
            child.AddComponent<MeshFilter>().sharedMesh = m = new Mesh { indexFormat = IndexFormat.UInt32 };
            child.AddComponent<MeshRenderer>().sharedMaterial = material;
            meshes[b.brick] = m;
            bricks.Add(child);
        }
        m.Clear();
        if (b.vertexCount == 0) return;
        m.SetVertexBufferParams(b.vertexCount, new VertexAttributeDescriptor(VertexAttribute.Position, VertexAttributeFormat.Float32, 3, 0),
                                new VertexAttributeDescriptor(VertexAttribute.Normal, VertexAttributeFormat.Float32, 3, 1));
        m.SetVertexBufferData(b.positions, 0, 0, 3 * b.vertexCount, 0);
        m.SetVertexBufferData(b.normals, 0, 0, 3 * b.vertexCount, 1);
        m.SetIndexBufferParams(b.indexCount, IndexFormat.UInt32);
        m.SetIndexBufferData(b.indices, 0, 0, b.indexCount);
        m.subMeshCount = 1;
        m.SetSubMesh(0, new SubMeshDescriptor(0, b.indexCount));
        m.RecalculateBounds();
    }
}
#endif
