-- Arithmetic of reals with functions.
local sqrt, sin = math.sqrt, math.sin
local degree = math.pi / 180
local begin = os.clock()
local s = 0.0
for i = 1, 1000000 do
  local x = i / 1000.0
  s = s + sqrt(x) * 0.5 - sin(x * degree)
  if s > 1000.0 then s = s - 1000.0 end
end
print(os.clock() - begin, s)
