-- A counting loop: integer arithmetic and if.
local begin = os.clock()
local s = 0
for i = 1, 3000000 do
  s = s + i * 3
  if s > 4000000 then s = s - 9000000 end
end
print(os.clock() - begin, s)
