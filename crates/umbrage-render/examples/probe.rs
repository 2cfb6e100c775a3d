use umbrage::*; use umbrage_render::*; use umbrage_wgpu::*; use umbrage_trace as ut;
use std::time::Instant;
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let name = &args[1];
    let scene = if name.contains('.') { umbrage_scene::load(name.as_ref())? } else { umbrage_scene::builtin(name, None)? };
    let tracer = ut::Tracer::new(&scene)?;
    let v = scene.default_view();
    let camera = Camera::look_at(LookAt{eye:v.eye,target:v.target,up:v.up,fov_y_rad:v.fov_y_rad,near:v.near,far:v.far,image:[480,270]})?;
    let light = scene.default_light().light;
    let boxes = tracer.boxes(256);
    let bounds = Bounds{receiver_parts:&boxes, ..Bounds::of_scene(scene.bounds())};
    let t=Instant::now();
    let gpu = Gpu::open()?;
    println!("{} open {:?}", gpu.info().name, t.elapsed());
    let t=Instant::now();
    let buffers = SceneBuffers::new(&gpu,&scene,false)?;
    println!("scene {:?}", t.elapsed());
    for (warp, slices) in [(Warp::Uniform,1),(Warp::Lispsm,1),(Warp::Adaptive(Objective::Storage),4),(Warp::Psm,1)] {
      for filter in [visibility::Filter::Hard, visibility::Filter::pcf(3)?] {
       for comparison in [Comparison::PerTexel, Comparison::Hardware] {
        let mut planner=Planner::new();
        let plan = planner.plan(&camera,&[light],&bounds,&Options{warp,partition:Partition::slices(slices),size:Size::Budget(1024*1024),..Options::default()})?;
        let t=Instant::now();
        let mut r = Renderer::new(&gpu,&buffers,&ShadowOptions{filter,comparison,..Default::default()})?;
        let made=t.elapsed();
        let t=Instant::now();
        let d = r.draw_maps(plan, Casters::Moved, None)?; gpu.wait()?;
        let drawn=t.elapsed();
        let t=Instant::now();
        let look=Look{camera:&camera,light:&light,light_index:0};
        let samples = r.samples(&look,0..270,1,true)?;
        let shaded=t.elapsed();
        let reference = ut::Reference::render(&tracer,plan,filter,&|_|{})?;
        let view = ut::View::new(&tracer,camera,light,1)?;
        let band=view.band(0..270,&|_|{});
        let vis = band.map(|s| reference.visibility(0,s),&|_|{});
        let truth = band.map(|s| view.truth(s),&|_|{});
        let (mut bad,mut n,mut wrong,mut wrongr,mut sum)=(0,0,0,0,0.0);
        let mut img=vec![0u8;480*270*3];
        for (i,s) in band.samples().iter().enumerate() {
            let g=samples[i];
            if let Some(s)=s { if s.is_facing && s.depth<=camera.far() { n+=1; sum+=(g.visibility-vis[i]).abs() as f64; if (g.visibility-vis[i]).abs()>0.5 {bad+=1; img[3*i]=255;} if (g.visibility-truth[i]).abs()>0.5{wrong+=1} if (vis[i]-truth[i]).abs()>0.5{wrongr+=1} } }
            let c=(g.visibility*120.0) as u8; img[3*i+1]=c; img[3*i+2]=c; if img[3*i]==0 {img[3*i]=c;}
        }
        println!("{warp:?}+z{slices}:{filter} {comparison:?}: differ {:.3}% mean {:.5} wrong gpu {:.3}% ref {:.3}%   made {made:?} maps {drawn:?} {d:?} shade {shaded:?}", 100.0*bad as f64/n as f64, sum/n as f64, 100.0*wrong as f64/n as f64,100.0*wrongr as f64/n as f64);
        if args.len()>2 { std::fs::write(format!("{}-{warp:?}{slices}{filter}{comparison:?}.ppm", args[2]), [b"P6 480 270 255\n".to_vec(),img].concat())?; }
       }}}
    Ok(())
}
