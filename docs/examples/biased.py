import remoras

fault = {
    "kind": "biased",
    "vehicle": "AUV02",
    "sensor": "classifier",
    "attribute": "location",
    "offset": [12.0, 0.0],
    "at_s": 0.0,
}
ban = {"issuer": "AUV00", "vehicle": "AUV02", "at_s": 600.0, "until_s": 1600.0}
run = remoras.run("mapping-objects", per=0.4, seed=3, set={"fault": [fault], "ban": [ban]})
for at_s in (590.0, 1590.0, 1750.0):
    known = run.known("ASV00", at_s)
    places = {b.subject: known.fused(b.subject, "location") for b in known.beliefs if b.attribute == "location"}
    print(at_s, dict(known.banned), {name: (place.value, place.origins) for name, place in places.items()})
