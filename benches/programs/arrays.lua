-- Elements of arrays, read and written.
local begin = os.clock()
local a = {}
for i = 0, 100 do a[i] = 0 end
local s = 0
for j = 1, 20000 do
  for i = 1, 100 do
    a[i] = a[i - 1] + i
    s = s + a[i]
  end
  a[0] = a[100] - a[99]
  if s > 100000000 then s = s - 100000000 end
end
print(os.clock() - begin, s)
