([x, y, z]) => {
    const at = new MeshCat.THREE.Vector3(x, z, -y);
    viewer.camera.updateMatrixWorld();
    at.project(viewer.camera);
    const box = document.querySelector("#scene").getBoundingClientRect();
    return [box.left + 0.5 * (1 + at.x) * box.width, box.top + 0.5 * (1 - at.y) * box.height];
}
