// SPDX-License-Identifier: MIT
// What UnityBone.cs names of the engine, as its manual declares it: so that a compiler without the engine checks the file.
#pragma warning disable 649
namespace UnityEngine
{
    using Rendering;

    public struct Vector3 { public float x, y, z; public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; } }
    public struct Vector3Int { public int x, y, z; public Vector3Int(int x, int y, int z) { this.x = x; this.y = y; this.z = z; } }
    public struct Quaternion { public float x, y, z, w; public Quaternion(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; } }
    public class Object { public static void Destroy(Object o) { } }
    public class Component : Object { public Transform transform { get { return null; } } }
    public class Behaviour : Component { public bool enabled { get; set; } }
    public class MonoBehaviour : Behaviour { }
    public class Transform : Component
    {
        public Vector3 position { get; set; }
        public Quaternion rotation { get; set; }
        public void SetParent(Transform parent, bool worldPositionStays) { }
        public void SetPositionAndRotation(Vector3 position, Quaternion rotation) { }
    }
    public class GameObject : Object
    {
        public GameObject(string name) { }
        public Transform transform { get { return null; } }
        public T AddComponent<T>() where T : Component { return null; }
    }
    public class Material : Object { }
    public class MeshFilter : Component { public Mesh sharedMesh { get; set; } }
    public class MeshRenderer : Component { public Material sharedMaterial { get; set; } }
    public class TextAsset : Object { public byte[] bytes { get { return null; } } }
    public static class Debug { public static void LogError(object message) { } }
    public sealed class Mesh : Object
    {
        public IndexFormat indexFormat { get; set; }
        public int subMeshCount { get; set; }
        public void Clear() { }
        public void SetVertexBufferParams(int vertexCount, params VertexAttributeDescriptor[] attributes) { }
        public void SetVertexBufferData<T>(T[] data, int dataStart, int meshBufferStart, int count, int stream = 0, MeshUpdateFlags flags = 0) where T : struct { }
        public void SetIndexBufferParams(int indexCount, IndexFormat format) { }
        public void SetIndexBufferData<T>(T[] data, int dataStart, int meshBufferStart, int count, MeshUpdateFlags flags = 0) where T : struct { }
        public void SetSubMesh(int index, SubMeshDescriptor desc, MeshUpdateFlags flags = 0) { }
        public void RecalculateBounds() { }
    }
}
namespace UnityEngine.Rendering
{
    public enum IndexFormat { UInt16, UInt32 }
    public enum MeshUpdateFlags { Default }
    public enum MeshTopology { Triangles }
    public enum VertexAttribute { Position, Normal }
    public enum VertexAttributeFormat { Float32 }
    public struct VertexAttributeDescriptor
    {
        public VertexAttributeDescriptor(VertexAttribute attribute = VertexAttribute.Position, VertexAttributeFormat format = VertexAttributeFormat.Float32, int dimension = 3, int stream = 0) { }
    }
    public struct SubMeshDescriptor { public SubMeshDescriptor(int indexStart, int indexCount, MeshTopology topology = MeshTopology.Triangles) { } }
}
