-- Calls of a function with an argument and a result.
local function mix(n)
  local t = n * 7
  return t - t // 16 * 16
end

local begin = os.clock()
local s, r = 0, 0
for i = 1, 1000000 do
  r = mix(i)
  s = s + r
  if s > 1000000 then s = s - 1000000 end
end
print(os.clock() - begin, s)
